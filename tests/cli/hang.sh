#!/bin/sh
# A criterion that never returns from what it is asked: the first TERM ends whoever asked, and whom it has started.
. "$(dirname "$0")/tap_setup"
BUILD=${BUILD:-build}
hang=$BUILD/tests/abi/plugins/hang.so
long() { # long COMMAND...: once it succeeds; not for ever
    tries=0
    until "$@" >/dev/null 2>&1; do
        tries=$((tries + 1))
        [ $tries -lt 1200 ] || return 1
        sleep 0.1
    done
}
gone() { ! kill -0 "$1" 2>/dev/null; }
# The lock is free when nobody of those who were started is left.
ends() { # ends WHERE COMMAND...
    where=$1
    shift
    rm -f "$tmp/sign"
    LULL_HANG=$where LULL_HANG_SIGN=$tmp/sign flock --no-fork "$tmp/lock" "$@" &
    pid=$!
    long test -e "$tmp/sign" || { echo "it did not come so far"; return 1; }
    kill -TERM $pid
    long gone $pid || kill -KILL $pid
    wait $pid
    status=$?
    [ $status = 143 ] || { echo "exit status $status"; return 1; }
    long flock -n "$tmp/lock" true || { echo "one that it started is left"; return 1; }
}
for where in load entry create begin; do
    t "lull-render ends while the criterion hangs in $where" ends $where "$BUILD/bin/lull-render" tests/cli/room.pbrt -o "$tmp/x.exr" -c "$hang"
done
for where in load entry create begin evaluate; do
    t "lull-check ends while the criterion hangs in $where" ends $where "$BUILD/bin/lull-check" "$hang"
done
t "no picture, no temporary" sh -c '[ -z "$(ls "$1" | grep -v -e log -e sign -e lock)" ]' - "$tmp"
echo "1..$n"
