#!/bin/sh
# The cross-check: builds what it needs, installs avr8js if it is missing, and runs crosscheck.mjs.
#
# Usage: tools/crosscheck/run.sh [--case text]
# Exit:  0 all cases passed, or there is no Node 20; 1 a case failed; 2 nothing could be compared.
# Guide: docs/crosscheck.md
set -eu

cd "$(dirname "$0")/../.."
here=tools/crosscheck
out=${BUILD:-build}

major=$(node -p 'process.versions.node.split(".")[0]' 2>/dev/null || echo 0)
if [ "$major" -lt 20 ]; then
    echo 'crosscheck: skipped, needs Node 20 or newer'
    exit 0
fi

wanted=$(sed -n 's/.*"avr8js": "\([0-9.]*\)".*/\1/p' $here/package.json)
present=$(sed -n 's/^ *"version": "\([0-9.]*\)".*/\1/p' $here/node_modules/avr8js/package.json 2>/dev/null || true)
if [ "$present" != "$wanted" ]; then
    if ! command -v npm >/dev/null; then
        echo "crosscheck: skipped, avr8js $wanted is not installed and there is no npm to fetch it"
        exit 0
    fi
    echo "crosscheck: installing avr8js $wanted into $here/node_modules"
    (cd $here && npm ci --silent --ignore-scripts) || {
        echo 'crosscheck: avr8js could not be installed (npm ci failed)' >&2
        exit 2
    }
fi

${MAKE:-make} -s -f Makefile -f $here/crosscheck.mk crosscheck-parts
node test/crosscheck/compare_test.mjs
exec node $here/crosscheck.mjs "$@" "$out/sac" "$out/crosscheck"
