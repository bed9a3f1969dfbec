#!/bin/sh
# Tries the lines of docs/farm.md as they stand there: `xargs`; GNU parallel, with a part that fails and is taken up by --resume-failed,
# and with a script in place of ssh that runs commands on this machine; and what contrib/kubernetes/render.yaml runs in each of its pods,
# one of which is evicted. Each must give the picture of a single render, bit for bit. Needs `cargo build --release`, GNU
# parallel, and Python with PyYAML. Takes about half a minute.
set -eu
cd "$(dirname "$0")/.."
for tool in parallel xargs python3; do
    command -v $tool >/dev/null || { echo "$tool is missing; on Debian and Ubuntu: apt-get install $tool" >&2; exit 1; }
done
[ -x target/release/sparing ] || { echo "build first: cargo build --release" >&2; exit 1; }
root=$PWD
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
trap 'exit 1' INT TERM
mkdir "$folder/bin"
ln -s "$root/target/release/sparing" "$folder/bin/sparing"
PATH=$folder/bin:$PATH
export PATH
cp -r scenes models "$folder/"
cd "$folder"
cp scenes/cornell-box.pbrt scene.pbrt

options="--size 128x128 --spp 256"
line() { # FROM: the line of docs/farm.md that begins so, with the rest of its command, made small
    sed -n "/^    $1/,/[^\\\\]\$/p" "$root/docs/farm.md" | sed "s/scene.pbrt/scene.pbrt $options/; s/--threads 8/--threads 1/"
}
same() { # NAME
    sparing merge part-?.exr -o picture.exr 2>/dev/null
    sparing compare picture.exr single.exr --json > difference.json
    grep -Eq '"mse": *0(\.0)?[,}]?' difference.json || { cat difference.json >&2; echo "$1: the pictures differ" >&2; exit 1; }
    echo "$1: the merged picture is that of a single render"
    rm -f part-* picture.exr
}
# shellcheck disable=SC2086
sparing render scene.pbrt $options -o single.exr --progress none

echo "== xargs"
line 'seq 8' > xargs.sh
cat xargs.sh
sh -eu xargs.sh 2>/dev/null
same xargs

echo "== GNU parallel, $(parallel --version | head -n 1)"
# As ssh, it starts in the home folder, without this script's path.
mkdir home
cat > bin/instead-of-ssh <<'SSH'
#!/bin/sh
while [ $# -gt 0 ]; do
    case $1 in
        -[bceilopF]) shift 2 ;;
        -*) shift ;;
        *) break ;;
    esac
done
echo "$1" >> "$HOSTS"
shift
[ "$1" != -- ] || shift
cd "$HOME" && exec sh -c "$*"
SSH
chmod +x bin/instead-of-ssh
HOSTS=$folder/hosts HOME=$folder/home PARALLEL_SSH=$folder/bin/instead-of-ssh
export HOSTS HOME PARALLEL_SSH
# The line has braces that only bash knows.
line 'parallel' > parallel.sh
cat parallel.sh
# The first time, one part fails: where its file should be is a folder.
mkdir part-3.exr
bash -eu parallel.sh 2>/dev/null && { echo "a part that fails is not noticed" >&2; exit 1; }
awk 'NR > 1 && $7 != 0 { print "part " $1 " failed with exit code " $7 }' log
rmdir part-3.exr
bash -eu parallel.sh 2>/dev/null
[ "$(tail -n +2 log | wc -l)" = 9 ] || { cat log >&2; echo "more than the part that failed was rendered again" >&2; exit 1; }
for host in node1 node2; do
    grep -q "^$host\$" hosts || { echo "nothing ran on $host" >&2; exit 1; }
done
same parallel

echo "== Kubernetes indexed job, by hand"
python3 - "$root/contrib/kubernetes/render.yaml" > pod.sh <<'PYTHON'
import re
import sys

import yaml

job = yaml.safe_load(open(sys.argv[1]))
spec = job["spec"]
container = spec["template"]["spec"]["containers"][0]
assert (job["apiVersion"], job["kind"], spec["completionMode"]) == ("batch/v1", "Job", "Indexed")
assert container["command"] == ["/bin/sh", "-c"] and len(container["args"]) == 1
# The kubelet expands $(NAME) itself where it knows NAME, and leaves the rest to the shell.
environment = ["JOB_COMPLETION_INDEX"]
text = re.sub(r"\$\(([^()]*)\)", lambda m: "$" + m[1] if m[1] in environment else m[0], container["args"][0])
assert f"/{spec['completions']} " in text, "as many parts as completions"
print(text.replace("SCENE.pbrt", "scene.pbrt").replace("--spp 1024", "$OPTIONS"))
PYTHON
cat pod.sh
OPTIONS=$options
export OPTIONS
for index in 0 1 2 3 4 5 6 7; do
    if [ $index = 2 ]; then # evicted, and started again
        JOB_COMPLETION_INDEX=$index OPTIONS="--size 128x128 --spp 256" /bin/sh -c "$(cat pod.sh)" > pod.log 2>&1 &
        pid=$!
        while [ ! -e part-2.checkpoint.exr.lock ]; do sleep 0.01; done
        sleep 0.05
        kill -TERM $pid
        code=0
        wait $pid || code=$?
        echo "index 2 was evicted with exit code $code: $(find . -name 'part-2*' -printf '%f ')"
        [ $code = 130 ] && [ -e part-2.checkpoint.exr ] || { cat pod.log >&2; echo "no checkpoint of the pod" >&2; exit 1; }
    fi
    JOB_COMPLETION_INDEX=$index /bin/sh -c "$(cat pod.sh)" > pod.log 2>&1
done
same kubernetes
