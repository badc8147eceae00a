#!/bin/sh
# tests/run: what it counts as passed, failed and skipped, what it says of a test that crashes, hangs or says nothing, and how it ends.
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
n=0
test_of() { # test_of NAME < its lines: a script among the tests
    cat >"$tmp/$1" && chmod +x "$tmp/$1"
}
runs() { # runs NAME STATUS ARGS... < what is expected: the whole output (seconds and the folder aside) and the exit status of tests/run
    n=$((n + 1)) name=$1 want=$2
    shift 2
    cat >"$tmp/expected"
    JOBS=1 LIMIT_S="${limit:-600}" tests/run "$@" >"$tmp/log" 2>&1
    got=$?
    sed -e "s|$tmp/||g" -e 's/  *\([0-9]* passed.*\)  [0-9]*s$/ \1/' -e '/Segmentation fault/d' "$tmp/log" >"$tmp/said"
    if [ "$got" = "$want" ] && diff "$tmp/expected" "$tmp/said" >"$tmp/diff" 2>&1; then echo "ok $n - $name"; else
        echo "not ok $n - $name (exit status $got)"
        sed 's/^/#   /' "$tmp/diff"
    fi
}

test_of good.sh <<'END'
printf 'ok 1 - one\nok 2 - two\nok 3 - three # SKIP no such thing here\n1..3\n'
END
test_of skipped <<'END'
#!/bin/sh
printf 'not ok 1 # SKIP as cmocka spells it\n'
END
test_of bad.sh <<'END'
printf 'ok 1 - one\nnot ok 2 - two\n#   the reason\nok 3 - three\n'
exit 1
END
test_of quiet.sh <<'END'
echo nothing to say
END
test_of late.sh <<'END'
echo 'ok 1 - one'
echo 'then this'
exit 3
END
test_of crash <<'END'
#!/bin/sh
echo 'ok 1 - one'
kill -SEGV $$
END
test_of hang.sh <<END
echo 'ok 1 - one'
sh -c 'echo \$\$ >$tmp/child; exec sleep 600'
END
test_of stubborn <<'END'
#!/bin/sh
echo 'ok 1 - one'
exit 124
END
cat >"$tmp/replay-pt_ply" <<'END'
#!/bin/sh
[ $# = "$(find tests/fuzz/corpus/pt_ply -type f | wc -l)" ]
END
cp "$tmp/crash" "$tmp/replay-pt_pbrt"
: >"$tmp/replay-no_such_target"
chmod +x "$tmp"/replay-*

runs "tests that pass, and one that is skipped" 0 "$tmp/good.sh" "$tmp/skipped" <<'END'
good.sh 2 passed, 1 skipped
    ok 3 - three # SKIP no such thing here
skipped 0 passed, 1 skipped
    ok 1 # SKIP as cmocka spells it
2 passed, 0 failed, 2 skipped
END
runs "only skipped tests: nothing was tested" 1 "$tmp/skipped" <<'END'
skipped 0 passed, 1 skipped
    ok 1 # SKIP as cmocka spells it
0 passed, 0 failed, 1 skipped
END
runs "a test that fails" 1 "$tmp/bad.sh" "$tmp/good.sh" <<'END'
bad.sh 2 passed, 1 FAILED (exit 1)
    | ok 1 - one
    | not ok 2 - two
    | #   the reason
    | ok 3 - three
good.sh 2 passed, 1 skipped
    ok 3 - three # SKIP no such thing here
FAILED: bad.sh (exit 1)
    not ok 2 - two
    #   the reason
    ok 3 - three
4 passed, 1 failed, 1 skipped
END
runs "a test that says nothing, one that ends badly after its last line" 1 "$tmp/quiet.sh" "$tmp/late.sh" <<'END'
quiet.sh 0 passed, 1 FAILED (exit 0)
    | nothing to say
late.sh 1 passed, 1 FAILED (exit 3)
    | ok 1 - one
    | then this
FAILED: quiet.sh (exit 0)
    nothing to say
FAILED: late.sh (exit 3)
    ok 1 - one
    then this
1 passed, 2 failed, 0 skipped
END
runs "a crash" 1 --asan "$tmp/crash" <<'END'
crash 1 passed, 1 FAILED (exit 139)
    | ok 1 - one
FAILED: crash (exit 139)
    ok 1 - one
1 passed, 1 failed, 0 skipped
END
limit=60
runs "a test that hangs, and one that only ends as one that was stopped" 1 "$tmp/hang.sh" "$tmp/stubborn" <<'END'
hang.sh 1 passed, 1 FAILED (exit 124)
    | ok 1 - one
    | not ok - it did not end within 60 s (LIMIT_S)
stubborn 1 passed, 1 FAILED (exit 124)
    | ok 1 - one
FAILED: hang.sh (exit 124)
    not ok - it did not end within 60 s (LIMIT_S)
FAILED: stubborn (exit 124)
    ok 1 - one
2 passed, 2 failed, 0 skipped
END
n=$((n + 1))
if grep -q '^State:[^Z]*$' "/proc/$(cat "$tmp/child")/status" 2>/dev/null; then # Z: ended, and nobody has asked yet
    echo "not ok $n - what a stopped test had started ends with it"
else
    echo "ok $n - what a stopped test had started ends with it"
fi
limit=
runs "corpora: every file once, a crash, one without files" 1 --replay "$tmp/replay-pt_ply" "$tmp/replay-pt_pbrt" "$tmp/replay-no_such_target" <<'END'
replay-pt_ply 1 passed
replay-pt_pbrt 1 passed, 1 FAILED (exit 125)
    | ok 1 - one
    | xargs: replay-pt_pbrt: terminated by signal 11
replay-no_such_target 0 passed, 1 FAILED (exit 1)
    | tests/fuzz/corpus/no_such_target: no input
FAILED: replay-pt_pbrt (exit 125)
    ok 1 - one
    xargs: replay-pt_pbrt: terminated by signal 11
FAILED: replay-no_such_target (exit 1)
    tests/fuzz/corpus/no_such_target: no input
2 passed, 2 failed, 0 skipped
END
if [ "$(uname -m)" = x86_64 ]; then
mkdir "$tmp/tests"
cat >"$tmp/tests/way" <<'END'
#!/bin/sh
[ "$LULL_ISA" = base ] && echo 'ok 1 - it is told'
END
chmod +x "$tmp/tests/way"
printf '# why\n\nLULL_ISA=base way\nLULL_ISA=avx512 way # it fails there\n' >"$tmp/list"
export BUILD="$tmp"
runs "as on other processors: each line of a list" 1 "$tmp/skipped" --processors "$tmp/list" <<'END'
skipped 0 passed, 1 skipped
    ok 1 # SKIP as cmocka spells it
[LULL_ISA=base] tests/way 1 passed
[LULL_ISA=avx512] tests/way 0 passed, 1 FAILED (exit 1)
FAILED: [LULL_ISA=avx512] tests/way (exit 1)
1 passed, 1 failed, 1 skipped
END
unset BUILD
fi
runs "no test at all" 1 <<'END'
0 passed, 0 failed, 0 skipped
END
echo "1..$n"
