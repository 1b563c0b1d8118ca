#!/usr/bin/env bash
# Run the jobs of a manifest, and compare the results with baselines. The GitHub action and the GitLab template call this.
#
# usage: check-jobs.sh MANIFEST BASELINES RESULTS
#
# RESULTS is a folder for the outputs; results.jsonl, check.html, check.xml and check.md are written there, too. On GitHub
# the summary is added to the page of the run. The exit code is that of the step that failed, or 0.
set -uo pipefail
if [ $# -ne 3 ]; then
    echo "usage: check-jobs.sh MANIFEST BASELINES RESULTS" >&2
    exit 2
fi
manifest=$1 baselines=$2 results=$3

mkdir -p "$results" || exit 2
iccm batch "$manifest" --root "$results/outputs" >"$results/results.jsonl"
batch=$?
if [ $batch -gt 1 ]; then # wrong input, or stopped: there is nothing to compare
    exit $batch
fi
iccm check "$results/outputs" "$baselines" \
    --junit "$results/check.xml" --html "$results/check.html" --summary "$results/check.md"
check=$?
if [ -n "${GITHUB_STEP_SUMMARY:-}" ] && [ -f "$results/check.md" ]; then
    cat "$results/check.md" >>"$GITHUB_STEP_SUMMARY"
fi
[ $batch -ne 0 ] && exit $batch
exit $check
