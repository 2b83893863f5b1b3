# SPDX-License-Identifier: Apache-2.0
# The library never ends its host, prints, or touches the process: it does not even link to
# what could.
nm -D --undefined-only "$BUILD/lib/libimporton.so" | sed 's/.* U //; s/@.*//' |
    grep -xE '_?exit|_Exit|quick_exit|abort|raise|kill|signal|sigaction|setlocale|atexit|getenv|(__)?v?f?printf(_chk)?|puts|putchar|fputs|perror'
# What it exports is its own.
nm -D --defined-only "$BUILD/lib/libimporton.so" | awk '{print $3}' | sed 's/@.*//' |
    grep -v '^imp_[a-z]' | grep -vE '^_|asan|ubsan|tsan|sanitizer'
true
