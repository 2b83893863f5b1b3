#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Write a weather file (EPW) of a place that does not exist.

    scenes/make_weather.py [--latitude 50] [--longitude 10] [--timezone 1] [--seed 1] [--clear] > town.epw

For examples and tests, as files of real places have owners. Direct light is that of Meinel's clear
sky (1976), 1353 W/m^2 x .7^(m^.678) with the air mass m; clouds follow each other by a chain with
the seed: with the cover c of an hour, direct light is (1 - c)^1.5 of that, and diffuse light
between a tenth of the direct and .45 of what the sun would give without air. --clear: no clouds. Illuminances are
missing, as in many files, and temperatures and the rest are constant."""
import argparse
import math
import random

DAYS = (31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31)


def height(day, hour, latitude, longitude, timezone):
    """Sine of the sun's altitude: Spencer's series (1971)."""
    g = 2 * math.pi * (day + hour / 24) / 365
    declination = (.006918 - .399912 * math.cos(g) + .070257 * math.sin(g) - .006758 * math.cos(2 * g)
                   + .000907 * math.sin(2 * g))
    minutes = 229.18 * (.000075 + .001868 * math.cos(g) - .032077 * math.sin(g) - .014615 * math.cos(2 * g)
                        - .040849 * math.sin(2 * g))
    solar = hour + minutes / 60 + longitude / 15 - timezone
    turn = math.radians(15 * (solar - 12))
    lat = math.radians(latitude)
    return math.sin(lat) * math.sin(declination) + math.cos(lat) * math.cos(declination) * math.cos(turn)


def light(z, cover):
    """Direct and diffuse irradiance, W/m^2."""
    if z <= 0:
        return 0, 0
    mass = 1 / (z + .50572 * (math.degrees(math.asin(z)) + 6.07995) ** -1.6364)
    clear = 1353 * .7 ** (mass ** .678)
    direct = clear * (1 - cover) ** 1.5
    diffuse = z * (.1 * clear * (1 - cover) + .45 * 1353 * .7 ** mass * cover)
    return round(direct), max(round(diffuse), 1)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, value in (("latitude", 50), ("longitude", 10), ("timezone", 1)):
        p.add_argument("--" + name, type=float, default=value)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--clear", action="store_true")
    a = p.parse_args()
    chance = random.Random(a.seed)
    print(f"LOCATION,Nowhere,-,-,importon,000000,{a.latitude:g},{a.longitude:g},{a.timezone:g},100")
    print("DESIGN CONDITIONS,0\nTYPICAL/EXTREME PERIODS,0\nGROUND TEMPERATURES,0")
    print("HOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0\nCOMMENTS 1,made by scenes/make_weather.py\nCOMMENTS 2,")
    print("DATA PERIODS,1,1,Data,Sunday,1/1,12/31")
    cover, day = .5, 0
    for month, n in enumerate(DAYS, 1):
        for date in range(1, n + 1):
            for hour in range(1, 25):
                cover = min(max(cover + chance.gauss(0, .2) + .05 * (.55 - cover), 0), 1)
                z = height(day, hour - .5, a.latitude, a.longitude, a.timezone)
                direct, diffuse = light(z, 0 if a.clear else cover)
                level = round(direct * max(z, 0)) + diffuse
                print(f"2021,{month},{date},{hour},0,-,15,10,72,101325,9999,9999,9999,{level},{direct},{diffuse},"
                      "999999,999999,999999,9999,0,0,5,5,9999,99999,9,999999999,0,0,0,88,0,0,0")
            day += 1


if __name__ == "__main__":
    main()
