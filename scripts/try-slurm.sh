#!/bin/sh
# Tries contrib/slurm against a real Slurm: installs the distribution's packages if they are missing, starts the daemons on this machine
# with a configuration of their own, submits a render, takes one task's node away in the middle, waits for the merge, and compares
# with the picture of a single render. Needs root, a Debian-like system, and `cargo build --release`. Takes about two minutes.
set -eu
cd "$(dirname "$0")/.."
if [ "$(id -u)" -ne 0 ]; then
    echo "this starts daemons: run it as root, in a container" >&2
    exit 1
fi
if ! command -v slurmctld >/dev/null || ! command -v slurmd >/dev/null || ! command -v munged >/dev/null; then
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends slurmctld slurmd slurm-client munge
fi
SPARING=$PWD/target/release/sparing
[ -x "$SPARING" ] || { echo "build first: cargo build --release" >&2; exit 1; }
export SPARING
folder=$(mktemp -d)
host=$(hostname -s)
finish() {
    for name in slurmd slurmctld munged; do
        [ -f "$folder/$name.pid" ] || continue
        pid=$(cat "$folder/$name.pid")
        kill "$pid" 2>/dev/null || true
        # They write their state before they go.
        for _ in $(seq 50); do kill -0 "$pid" 2>/dev/null || break; sleep 0.1; done
    done
    rm -rf "$folder"
}
trap finish EXIT
trap 'exit 1' INT TERM

# Munge, as root: it wants a key and folders that nobody else may write to.
mkdir -p -m 755 "$folder/munge"
chmod 755 "$folder"
dd if=/dev/urandom of="$folder/munge.key" bs=128 count=1 2>/dev/null
chmod 600 "$folder/munge.key"
munged --force --key-file="$folder/munge.key" --socket="$folder/munge/socket" --pid-file="$folder/munged.pid" \
    --log-file="$folder/munge.log" --seed-file="$folder/munge.seed"

mkdir -p "$folder/state" "$folder/spool"
cat > "$folder/slurm.conf" <<CONF
ClusterName=try
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmctldPort=16817
SlurmdPort=16818
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket
CryptoType=crypto/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
KillWait=30
# A task that was put back starts again at once, not after the default of two minutes.
SchedulerParameters=requeue_delay=1
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF="$folder/slurm.conf"
slurmctld
slurmd -N "$host"
for _ in $(seq 60); do
    sinfo -h -o %T 2>/dev/null | grep -q idle && break
    sleep 1
done
sinfo

scene=$PWD/scenes/cornell-box.pbrt
options="--size 192x192 --spp 800"
# shellcheck disable=SC2086
set -- $(contrib/slurm/submit.sh 4 "$folder/picture.exr" "$scene" $options)
array=$1 merge=$2
echo "array $array, merge $merge"
while [ ! -f "$folder/picture.exr.parts/part-1.checkpoint.exr" ]; do sleep 0.2; done
echo "part 1 runs and has a checkpoint: its node is taken away"
scontrol requeue "${array}_1"
for _ in $(seq 600); do
    [ -n "$(squeue -h -j "$array,$merge" 2>/dev/null)" ] || break
    sleep 1
done
cat "$folder/picture.exr.parts/merge.log"
restarts=$(grep -c 'ALF_PROGRESS' "$folder/picture.exr.parts/part-1.log" || true)
echo "part 1 reported $restarts times"
# shellcheck disable=SC2086
"$SPARING" render "$scene" $options -o "$folder/single.exr" --progress none
"$SPARING" compare "$folder/picture.exr" "$folder/single.exr" --json > "$folder/difference.json"
if ! grep -Eq '"mse": *0(\.0)?[,}]?' "$folder/difference.json"; then
    cat "$folder/difference.json" >&2
    echo "the pictures differ" >&2
    exit 1
fi
echo "the merged picture is that of a single render"
