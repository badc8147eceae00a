#!/bin/sh
# lull-denoiser-setup: fetches Open Image Denoise to where Lull finds it, once, and leaves nothing where it cannot. A made wheel in the
# place of the package index.
. "$(dirname "$0")/lull_render_setup"
top=$(cd "$here/../.." && pwd) build=$(dirname "$(dirname "$P")")
program=$top/scripts/packages/lull-denoiser-setup
real=$(command -v python3)
mkdir -p fake/bin wheel/oidn/lib
cp "$build/tests/oidn-stub/libOpenImageDenoise.so.2" wheel/oidn/lib/
for part in libOpenImageDenoise_core.so.2.5.0 libOpenImageDenoise_device_cpu.so.2.5.0 libtbb.so.12 libOpenImageDenoise_device_cuda.so.2.5.0; do echo part >wheel/oidn/lib/$part; done
(cd wheel && "$real" -m zipfile -c ../pyoidn-2.5.0.whl oidn)
cat >fake/bin/python3 <<END
#!/bin/sh
[ "\$1 \$2" = "-m venv" ] || exec "$real" "\$@"
mkdir -p "\$3/bin" && printf '#!/bin/sh\n[ ! -e "$PWD/offline" ] || { cat "$PWD/offline" >&2; exit 1; }\nwhile [ "\$1" != --dest ]; do shift; done\ncp "$PWD/pyoidn-2.5.0.whl" "\$2"\n' >"\$3/bin/pip" && chmod +x "\$3/bin/pip"
END
chmod +x fake/bin/python3
PATH=$PWD/fake/bin:$PATH
XDG_DATA_HOME=$PWD/data
export PATH XDG_DATA_HOME
unset LULL_OIDN
to=$XDG_DATA_HOME/lull/oidn
echo "no index" >offline
said() { # said STATUS LINE COMMAND...: that status, and on the error's side one line with these words, or none
    status=0 wanted=$1 line=$2
    shift 2
    "$@" >out 2>err || status=$?
    cat out err
    [ "$status" = "$wanted" ] && if [ "$line" ]; then [ "$(wc -l <err)" = 1 ] && grep -q -e "$line" err; else [ ! -s err ]; fi
}
t "without an index there is one line" said 1 "no Open Image Denoise: no index (a Python package index is needed)" "$program" "$to"
t "  …and nothing is left" test ! -e "$to" -a ! -e "$to.part"
echo "ERROR: Could not install packages due to an OSError: [Errno 28] No space left on device" >offline
t "a full disk is no missing index" said 1 "no room in $XDG_DATA_HOME/lull.*No space left on device)$" "$program" "$to"
printf '#!/bin/sh\necho aarch64\n' >fake/bin/uname && chmod +x fake/bin/uname
echo "ERROR: No matching distribution found for pyoidn<3,>=2.5" >offline
t "nor is another processor" said 1 "pyoidn is for x86-64, and this is aarch64" "$program" "$to"
rm offline fake/bin/uname
mv pyoidn-2.5.0.whl kept && head -c 4000000 /dev/zero >wheel/oidn/lib/large && (cd wheel && "$real" -m zipfile -c ../pyoidn-2.5.0.whl oidn)
t "a disk that fills up while it is unpacked" said 1 "no room in .*File too large" sh -c "ulimit -f 4000 && exec '$program' '$to'"
t "  …and nothing is left" test ! -e "$to" -a ! -e "$to.part"
mv kept pyoidn-2.5.0.whl
t "it is fetched" said 0 "" "$program" "$to"
t "  …four files, no others" sh -c "[ \"\$(ls '$to' '$to/lib' | wc -l)\" = 8 ] && [ ! -e '$to.part' ] && cat out | grep -qx '$to'"
t "a second time nothing is done" sh -c "touch offline && '$program' '$to' | grep -qx '$to'"
# away from build/oidn, which it would find first
mkdir -p inst/bin inst/lib && cp "$P" inst/bin && cp -R "$build/lib/lull" inst/lib
t "lull-render finds it there" sh -c "OIDN_STUB=box inst/bin/lull-render '$scene' -q --size 48x32 --block 16 --spp-max 32 --denoise -o d.exr && [ -s d.exr ]"
t "unknown options and more arguments are refused" sh -c "! '$program' --x 2>err && grep -q -- '--x: unknown option' err && ! '$program' a b 2>err && grep -q 'b: one argument too many' err"
t "  …and says how to get it where it is not" sh -c "! XDG_DATA_HOME=/nowhere HOME=/nowhere inst/bin/lull-render '$scene' -q --denoise -o e.exr 2>err &&
    [ \$(wc -l <err) = 1 ] && grep -q lull-denoiser-setup err"
t "scripts/setup --denoiser is the same program" grep -q 'packages/lull-denoiser-setup build/oidn' "$top/scripts/setup"
echo "1..$n"
