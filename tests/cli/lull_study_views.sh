#!/bin/sh
# What `lull-study init` takes as views: some blocks, kinds of denoised renders, clips; and how answers to clips are kept and counted.
. "$(dirname "$0")/ggn_setup"
server=
trap 'kill $server 2>/dev/null; rm -rf "$tmp"' EXIT
picture() { # picture FILE SIZE NUMBER: noise that only its number decides
    oiiotool --create "$2" 3 --addc 0.5 --noise:type=gaussian:mean=0:stddev=0.1:seed="$3" -d uint8 -o "$1"
}
mkdir "$tmp/levels"
for name in reference:1 n-16:2 n-64:3 n-256:4; do picture "$tmp/levels/${name%:*}.png" 32x16 "${name#*:}"; done
asked="--task thresholds --method 2ifc --block 16 --asked-by Ada --contact here"
init() { # init VIEW [OPTION]...: makes $tmp/study
    rm -rf "$tmp/study"
    "$bin/lull-study" init "$tmp/study" $asked --views "$@" >"$tmp/out" 2>"$tmp/err"
}
refuses() { # refuses NAME TEXT VIEW [OPTION]...: one line that has the text, exit 2, and no study
    name=$1 text=$2
    shift 2
    init "$@"
    [ $? -eq 2 ] && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -qF -- "$text" "$tmp/err" && [ ! -e "$tmp/study/study.json" ]
    check "refused: $name" $?
}

# --- blocks ---
init "$tmp/levels/:1" && grep -q '"id":.1,' "$tmp/study/study.json" && ! grep -q '"id":.0,' "$tmp/study/study.json" &&
    [ -e "$tmp/study/stimuli/v0/b1-64.png" ] && [ ! -e "$tmp/study/stimuli/v0/b0-64.png" ]
check "only the blocks that are named" $?
init "$tmp/levels:0-1" && [ -e "$tmp/study/stimuli/v0/b0-64.png" ] && [ -e "$tmp/study/stimuli/v0/b1-64.png" ]
check "a range of blocks" $?
for blocks in 2 0-2 2,0 1,2; do refuses "blocks $blocks" "levels: has no block 2" "$tmp/levels:$blocks"; done
for word in "" 1,,2 1- -1 1,; do refuses "a folder that ends in :$word" "levels:$word: " "$tmp/levels:$word"; done
"$bin/lull-study" init "$tmp/study" --task validation --asked-by Ada --contact here --views "$tmp/levels:0" >"$tmp/out" 2>"$tmp/err"
[ $? -eq 2 ] && grep -q "shows whole pictures, not blocks" "$tmp/err"; check "refused: blocks of a validation" $?

# --- kinds ---
for kinds in grain noisy,noisy noisy, denoisedx; do
    refuses "--kinds $kinds" "--kinds $kinds: expected some of noisy,denoised,blend" "$tmp/levels" --kinds $kinds
done
refuses "kinds of settings" "--kinds does nothing in this task (adjustment)" "$tmp/levels" --method adjustment --kinds noisy
refuses "denoised of what was not" "n-16.png: has no channels R, G and B in a layer 'denoised' (--kinds shows renders" "$tmp/levels" --kinds denoised
refuses "blend of what is none" "n-16.png: has no channel 'lull.weight.V' (--kinds shows renders" "$tmp/levels" --kinds blend

# --- clips ---
clip() { # clip FOLDER SEED FRAME...
    mkdir -p "$1"
    for frame in $3; do picture "$1/f_$frame.png" 32x16 $(($2 + 1$frame)); done
}
for level in reference:100 16:200 64:300 256:400; do clip "$tmp/room/${level%:*}" "${level#*:}" "0007 0009 0011"; done
init "$tmp/room" --fps 10 && grep -q '"frames":.3' "$tmp/study/study.json" && grep -q '"show_ms":.600' "$tmp/study/study.json"
check "a clip: two loops at the rate that is said" $?
part() { # part FRAME FILE: whether the frame of block 1 is that part of the file
    oiiotool "$tmp/study/stimuli/v0/b1-64.png" --cut 16x16+0+$((16 * $1)) --origin +0+0 "$2" --cut 16x16+16+0 --origin +0+0 \
        --fail 0 --diff >"$tmp/out" 2>&1
}
part 0 "$tmp/room/64/f_0007.png" && part 1 "$tmp/room/64/f_0009.png" && part 2 "$tmp/room/64/f_0011.png"
check "its frames lie below each other, in order" $?
! part 1 "$tmp/room/64/f_0007.png"; check "  …each another" $?
init "$tmp/room" "$tmp/levels" && grep -q '"fps":.24' "$tmp/study/study.json" && grep -q '"show_ms":.250' "$tmp/study/study.json"
check "clips and stills together, at 24 frames a second" $?
refuses "--fps of stills" "--fps does nothing: no view is a clip" "$tmp/levels" --fps 24
refuses "clips of settings" "room: clips are shown in two intervals" "$tmp/room" --method adjustment
refuses "less than a loop" "150 ms are 2 frames at 10 a second, wanted 3 (one loop) to 60" "$tmp/room" --fps 10 --show 150
refuses "more frames than are kept" "6100 ms are 61 frames" "$tmp/room" --fps 10 --show 6100
mkdir -p "$tmp/tall/reference"
for frame in 1 2 3 4 5; do picture "$tmp/tall/reference/$frame.png" 8x4096 $frame; done
refuses "more rows than browsers take" "tall: 5 frames of blocks of 4096 pixels, wanted at most 16384 rows" "$tmp/tall" --block 4096
spoilt() { # spoilt NAME TEXT COMMAND...: the clip after the command, which is told its folder
    rm -rf "$tmp/bad" && cp -r "$tmp/room" "$tmp/bad"
    name=$1 text=$2
    shift 2
    (cd "$tmp/bad" && "$@") && refuses "$name" "$text" "$tmp/bad"
}
spoilt "a frame that is missing" "bad/64: no frame 9, which the reference has" rm 64/f_0009.png
spoilt "the last that is missing" "bad/64: no frame 11, which the reference has" rm 64/f_0011.png
spoilt "one frame too many" "bad/64: frame 13, which the reference does not have" cp 64/f_0009.png 64/f_0013.png
spoilt "a gap in the reference" "bad/reference: frames are missing between 9 and 13" mv reference/f_0011.png reference/f_0013.png
spoilt "a frame twice" "bad/reference: frames are missing between 9 and 9, or one is there twice" cp reference/f_0009.png reference/g_0009.png
spoilt "a single frame" "bad/reference: 1 frames, wanted 2 … 60" rm reference/f_0009.png reference/f_0011.png
spoilt "no frames" "bad/16: 0 frames, wanted 2 … 60" rm -r 16/f_0007.png 16/f_0009.png 16/f_0011.png
spoilt "a name without a number" "bad/16/x.png: not a picture whose name ends in the number" mv 16/f_0007.png 16/x.png
spoilt "no reference" "bad: neither manifest.json nor a picture called reference" rm -r reference
spoilt "a file that is no picture" "256/f_0009.png" sh -c 'echo no >256/f_0009.png'
picture "$tmp/small.png" 16x16 9
spoilt "another size" "256/f_0009.png: 16x16 pixels, the reference has 32x16" cp "$tmp/small.png" 256/f_0009.png
spoilt "another size inside the reference" "reference/f_0011.png: 16x16 pixels" cp "$tmp/small.png" reference/f_0011.png

# --- answers to clips ---
init "$tmp/room" "$tmp/levels:0" --fps 10 --trials 10 --catch 0
check "a study of both" $?
serve() {
    rm -f "$tmp/link"
    "$bin/lull-study" serve "$tmp/study" --listen 127.0.0.1:0 >"$tmp/link" 2>"$tmp/err" &
    server=$!
    while [ ! -s "$tmp/link" ] && kill -0 $server 2>/dev/null; do sleep 0.1; done
}
serve
python3 - "$(cat "$tmp/link")" >"$tmp/out" 2>&1 <<'END'
import json, sys, urllib.error, urllib.request

def ask(address, body=None):
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(sys.argv[1] + address, data, {"Content-Type": "application/json"} if data else {})
    try:
        return json.load(urllib.request.urlopen(request))
    except urllib.error.HTTPError as e:
        return e.code, json.load(e)["error"]

even, dropped = " ".join(["100"] * 12), " ".join(["100"] * 4 + ["300", "0"] + ["100"] * 6)
wrong = ["", even + " 100", even[:-4], even.replace("100", "1e2", 1), " " + even, even + " ", even.replace("100", "10000", 1), "-" + even, 100, None, "9" * 700]
study, me = ask("api/study"), ask("api/people", {"consent": True})
address = f"api/people/{me['key']}"
clips = 0
for i, slot in enumerate(ask(address)["slots"]):
    clip = "frames" in study["views"][slot["view"]]
    trial = {"slot": i, "revision": 0, "level": 64, "answer": slot["side"] + 1, "rating": 0, "ms": 900}
    for times in wrong if clip and clips == 0 else [even] if not clip else []:
        assert ask(address + "/trials", {**trial, "frame_ms": times}) == (400, "no times of frames"), times
    if clip:
        assert ask(address + "/trials", trial) == (400, "no times of frames")
        trial["frame_ms"] = dropped if clips % 4 == 0 else even
        clips += 1
    assert "done" in ask(address + "/trials", trial)
    if clip:
        assert "done" in ask(address + "/trials", trial)
        assert ask(address + "/trials", {**trial, "frame_ms": even.replace("100", "99", 1)})[0] == 409
assert clips == 20, clips
END
check "answers: times of frames with clips, none with stills, and never others" $?
kill $server && wait $server
"$bin/lull-study" report "$tmp/study" --no-pictures >"$tmp/out" 2>"$tmp/err" &&
    grep -q "^5 answers to clips with a frame that the screen never showed are left out" "$tmp/out" &&
    awk -F';' 'NR == 2 { ok = $11 == 5 } END { exit !ok }' "$tmp/study/report/people.csv" && grep -q '"dropped_answers":.5' "$tmp/study/report/report.json"
check "report: trials with a dropped frame are counted" $?
awk -F';' '$2 == "room" { n += $NF; rows++ } END { exit !(rows >= 1 && n <= 15) }' "$tmp/study/report/estimates.csv"
check "  …and in no estimate" $?
"$bin/lull-study" status "$tmp/study" >"$tmp/out" 2>"$tmp/err" && grep -q "5 with frames that were never shown" "$tmp/out"
check "status: says so" $?
"$bin/lull-study" export "$tmp/study" -o "$tmp/trials.json" >"$tmp/out" 2>"$tmp/err" && mkdir "$tmp/copy" &&
    cp "$tmp/study/study.json" "$tmp/copy" && "$bin/lull-study" import "$tmp/copy" "$tmp/trials.json" >"$tmp/out" 2>"$tmp/err" &&
    "$bin/lull-study" export "$tmp/copy" -o "$tmp/again.json" >"$tmp/out" 2>"$tmp/err" && cmp "$tmp/trials.json" "$tmp/again.json" &&
    [ "$(grep -c '"frame_ms"' "$tmp/again.json")" -eq 20 ]
check "export and import keep the times" $?
sed 's/"frame_ms":.*"[0-9]* /"frame_ms": "/' "$tmp/trials.json" >"$tmp/other.json" && rm "$tmp"/copy/study.db*
"$bin/lull-study" import "$tmp/copy" "$tmp/other.json" >"$tmp/out" 2>"$tmp/err"
[ $? -eq 2 ] && grep -q "has a trial that this study cannot have" "$tmp/err"; check "import: no other times" $?

# --- studies from before there were clips ---
init "$tmp/levels" && serve && kill $server && wait $server
python3 -c "import sqlite3, sys
db = sqlite3.connect(sys.argv[1])
db.execute('ALTER TABLE trial DROP COLUMN frame_ms')" "$tmp/study/study.db" >"$tmp/out" 2>&1 &&
    "$bin/lull-study" status "$tmp/study" >"$tmp/out" 2>"$tmp/err" && grep -q "0 people" "$tmp/out"
check "a data base without times is taken" $?
echo "1..$n"
exit $bad
