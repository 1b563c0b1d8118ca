#!/usr/bin/env bash
# Comment a summary on a pull request of GitHub; a later run replaces the comment of an earlier one.
#
# usage: comment.sh SUMMARY.md OWNER/REPOSITORY NUMBER
#
# It needs gh, which GitHub's machines have, and GH_TOKEN. Where commenting is not permitted, as for pull requests from
# forks, it warns and the exit code is 0, since the comparison itself does not depend on the comment.
set -uo pipefail
if [ $# -ne 3 ]; then
    echo "usage: comment.sh SUMMARY.md OWNER/REPOSITORY NUMBER" >&2
    exit 2
fi
summary=$1 comments=repos/$2/issues/$3/comments
mark="<!-- iccm check -->" # not shown; by it the comment of an earlier run is found
if [ ! -f "$summary" ]; then
    echo "$summary: there is no summary, since nothing was compared"
    exit 0
fi

text=$(printf '%s\n%s' "$mark" "$(cat "$summary")")
earlier=$(gh api --paginate "$comments" --jq ".[] | select(.body | startswith(\"$mark\")) | .id") || earlier=""
earlier=${earlier%%$'\n'*}
if [ -n "$earlier" ]; then
    gh api --silent --method PATCH "repos/$2/issues/comments/$earlier" --raw-field body="$text"
else
    gh api --silent --method POST "$comments" --raw-field body="$text"
fi || echo "::warning::the summary could not be added to the pull request; does the job have pull-requests: write?"
