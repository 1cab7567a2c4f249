# Sourced by other scripts, never run: runs commands side by side, each with a log, and tells how each ended.
# Uses the script's own say.

JOB_LOGS=$REPO/target/logs
declare -A JOB_NAMES=()

# Starts a command in the background; its output goes to target/logs/NAME.log.
start_job() { # name, command…
  local name=$1
  shift
  mkdir -p "$JOB_LOGS"
  (
    began=$SECONDS
    # Not part of a condition, so that `set -e` holds inside functions.
    set +e
    (set -e; "$@") >"$JOB_LOGS/$name.log" 2>&1
    status=$?
    if [ "$status" -eq 0 ]; then
      say "$name: done in $((SECONDS - began)) s"
    else
      tail -n 60 "$JOB_LOGS/$name.log" >&2
      say "$name: FAILED (exit status $status; whole log: ${JOB_LOGS#"$REPO/"}/$name.log)"
    fi
    exit "$status"
  ) &
  JOB_NAMES[$!]=$name
}

# Waits for all jobs. Fails if any has failed, after the others have ended.
wait_for_jobs() {
  local pid status=0
  for pid in "${!JOB_NAMES[@]}"; do wait "$pid" || status=1; done
  JOB_NAMES=()
  return "$status"
}

# A script that is stopped stops its jobs.
trap 'trap - EXIT; kill "${!JOB_NAMES[@]}" 2>/dev/null; exit 130' INT TERM
