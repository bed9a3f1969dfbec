#!/bin/sh
# Renders a scene on a Slurm cluster: an array of parts, and a job that puts them together when all are done.
#
#     contrib/slurm/submit.sh PARTS OUTPUT.exr SCENE [options of sparing render]
#
# Options of sbatch go into SBATCH_OPTIONS, for example SBATCH_OPTIONS='--partition=long --cpus-per-task=16'. The folder
# OUTPUT.parts keeps parts and checkpoints and must be seen by all nodes; it may be removed afterwards. Prints the two job numbers.
set -eu
if [ $# -lt 3 ]; then
    sed -n '2,8s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
parts=$1 output=$2
shift 2
here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
SPARING=${SPARING:-$(command -v sparing || true)}
if [ -z "$SPARING" ]; then
    echo "sparing is not on the PATH: say where it is by SPARING=/path/to/sparing" >&2
    exit 1
fi
SPARING_PARTS=$parts SPARING_OUTPUT=$output SPARING_FOLDER=$output.parts
case $SPARING_FOLDER in
*[[:space:]]*)
    echo "the output's name must have no blanks" >&2
    exit 2
    ;;
esac
export SPARING SPARING_PARTS SPARING_OUTPUT SPARING_FOLDER
mkdir -p "$SPARING_FOLDER"
# Unquoted: several options.
# shellcheck disable=SC2086
array=$(sbatch --parsable ${SBATCH_OPTIONS:-} --job-name=sparing --array="1-$parts" --export=ALL \
    --output="$SPARING_FOLDER/part-%a.log" "$here/part.sh" "$@")
# shellcheck disable=SC2086
merge=$(sbatch --parsable ${SBATCH_OPTIONS:-} --job-name=sparing-merge --dependency="afterok:$array" --export=ALL \
    --output="$SPARING_FOLDER/merge.log" "$here/merge.sh")
echo "$array $merge"
