# SPDX-License-Identifier: Apache-2.0
# Manifests and parts are data from somebody else. A command in one is run only if it computes, and
# with options that neither write, send, show nor read what the file does not list: everything
# else is refused by its name, and before anything runs.
cp "$ROOT/scenes/furnace.xml" scene.xml
echo "the user's own" >victim.txt
echo "PASSWORD=hunter2" >secret.txt
mkdir results
importon render scene.xml -D res=8 --spp 2 -q -o results/a.exr
ls -R >before
quoted() { printf "'%s' " "$@" | sed 's/ $//'; }
# attack WORD..., as a manifest and as a part
attack() {
    for kind in manifest part; do "$BUILD/tests/cli/forge" $kind bad.$kind "$(quoted "$@")"; done
    importon verify bad.manifest 2>&1
    [[ $? == 2 ]] || echo "verify $*: exit $?"
    importon merge bad.part 2>&1
    [[ $? == 2 ]] || echo "merge $*: exit $?"
    importon merge bad.part -o larger.part >out 2>&1
    [[ $? == 2 ]] || echo "merge to a part, $*: $(cat out)"
    rm -f bad.manifest bad.part out
}
attack report --overwrite --output=victim.txt -- results
attack info --overwrite --output=victim.txt -- scene.xml
attack record --output=victim.txt -- scene.xml
attack view -- scene.xml
attack verify -- bad.manifest
attack merge -- bad.part
attack bench --manifest=victim.txt -- scene.xml
attack render --spp=1 --paths=victim.txt --overwrite -- scene.xml
attack render --spp=1 --overwrite -- scene.xml
attack render --spp=1 --output=victim.txt -- scene.xml
attack render --spp=1 --display=127.0.0.1:9 -- scene.xml
attack render --spp=1 --manifest=new.txt -- scene.xml
attack render --spp=1 --part=1/2 -- scene.xml
attack render --dump -- scene.xml
attack render --pixel=1,1 -- scene.xml
attack render --time=9 -- scene.xml
attack render --help -- scene.xml
attack render --threads=4096 -- scene.xml
attack render --set=@secret.txt -- scene.xml
attack gradient --textures=results --spp=1 -- scene.xml
attack gradient --spectra=new -- scene.xml
attack jacobian --layers=victim.txt -- scene.xml
attack jacobian --sheet=new.png -- scene.xml
attack fit --checkpoint=new --target=results/a.exr -- scene.xml
attack fit --sheet=new.png --target=results/a.exr -- scene.xml
# Other ways to write an option: abbreviated, by its letter, its value in a word of its own, behind
# an operand, with a value that it does not have, and without the end of options.
attack render --outp=victim.txt -- scene.xml
attack render -o victim.txt -- scene.xml
attack render -ovictim.txt -- scene.xml
attack render --set @secret.txt -- scene.xml
attack render scene.xml --output=victim.txt --
attack render --overwrite=1 -- scene.xml
attack render --se=1 -- scene.xml
attack render --spp=1 scene.xml
attack render --spp=1 --
attack render --spp=1 -- scene.xml --output=victim.txt
attack --help
attack ''
"$BUILD/tests/cli/forge" manifest bad.manifest "render --output=victim.txt scene.xml"
importon verify bad.manifest 2>&1
# A manifest's file that it does not list is not looked into, nor is standard input.
"$BUILD/tests/cli/forge" manifest bad.manifest "$(quoted render --spp=1 -- secret.txt)"
importon verify bad.manifest 2>&1
"$BUILD/tests/cli/forge" manifest bad.manifest "$(quoted render --spp=1 -- -)"
importon verify bad.manifest <secret.txt 2>&1
rm -f bad.manifest
cat victim.txt secret.txt
ls -R | sed '/^before$/d' | diff - <(sed '/^before$/d' before) && echo "no file came, none went"
# The picture of parts has the name of the first, wherever their scene is; settings of a file are
# carried themselves.
echo "ball.reflectance.value=0.7" >settings.txt
mkdir elsewhere
cp scene.xml elsewhere/victim.xml
for i in 1 2; do
    importon render elsewhere/victim.xml -D res=8 --spp 8 --set @settings.txt --part $i/2 -o mine$i.part -q
done
importon render scene.xml -D res=8 --spp 8 --set @settings.txt -o whole.exr -q --no-preview
rm settings.txt
importon merge mine1.part mine2.part -q
importon compare whole.exr mine1.exr | grep max
importon verify whole.exr.manifest
importon render scene.xml --spp 8 --pixel 1,1 --part 1/2 -o x.part
ls
# Names of others move no cursor.
mkdir $'e\033[31m'
cp scene.xml $'e\033[31m/s.xml'
importon render $'e\033[31m/s.xml' -D res=4 --spp 1 -q -o esc.exr --no-preview
echo x >$'e\033[31m/s.xml'
importon verify esc.exr.manifest 2>&1
echo "exit $?"
