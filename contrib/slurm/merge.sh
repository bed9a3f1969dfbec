#!/bin/sh
# Puts the parts together, once all are there. Submitted by submit.sh.
set -eu
parts=
i=1
while [ "$i" -le "$SPARING_PARTS" ]; do
    parts="$parts $SPARING_FOLDER/part-$i.exr"
    i=$((i + 1))
done
# The folder's name must have no blanks: submit.sh has checked that.
exec "$SPARING" merge $parts -o "$SPARING_OUTPUT"
