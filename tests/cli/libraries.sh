#!/bin/sh
# What each criterion brings into a host: the libraries that it is linked with, and that opening one by its name opens no other.
# What ggn is linked with.
BUILD=${BUILD:-build} n=0 bad=0
lib=$BUILD/lib/lull
err=$(mktemp) || exit 2
trap 'rm -f "$err"' EXIT
t() { # t TITLE COMMAND...
    title=$1
    shift
    n=$((n + 1))
    if "$@" >"$err" 2>&1; then echo "ok $n - $title"; else bad=1; echo "not ok $n - $title"; sed 's/^/# /' "$err"; fi
}
needs() { # needs FILE NAME...: exactly these, beside the C library and the sanitizers'
    got=$(objdump -p "$1" | awk '/NEEDED/ { print $2 }' | grep -vE '^lib(c|asan|ubsan)[.]so' | sed 's/[.]so.*//' | sort | tr '\n' ' ')
    shift
    echo "linked with: $got"
    [ "$got" = "$(printf '%s\n' "$@" | sort | tr '\n' ' ')" ]
}
t "observer.so needs the mathematical library" needs "$lib/observer.so" libm
t "denoised.so needs the mathematical library, and no denoiser" needs "$lib/denoised.so" libm
t "ggn.so needs no BLAS" needs "$lib/ggn.so" libcjson libm
t "baselines.so needs libsvm, and OpenBLAS when it is asked only" needs "$lib/baselines.so" libcjson libm libsvm
for k in fixed halfbuf variance; do t "$k.so needs the mathematical library" needs "$lib/$k.so" libm; done
t "ggn needs libsvm and what reads and writes files, no BLAS" needs "$BUILD/bin/ggn" libcjson libm libpng16 libsvm libz
only() { # only NAME: opened by it, NAME.so is the one library of criteria that is loaded
    LD_DEBUG=files "$BUILD/bin/lull-check" -q -o table "$1" 2>&1 | sed -n 's|.*calling init: .*/\([a-z_-]*[.]so\)$|\1|p' | sort -u >"$err.names"
    loaded=$(grep -xE "$(ls "$lib" | tr '\n' '|' | sed 's/|$//')" "$err.names" | tr '\n' ' ')
    rm -f "$err.names"
    echo "loaded: $loaded"
    [ "$loaded" = "$1.so " ]
}
for k in observer halfbuf null; do t "$k opens $k.so and no other" only $k; done
echo "1..$n"
exit $bad
