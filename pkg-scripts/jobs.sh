# Sourced by other scripts, never run: runs commands side by side, each with a log, and tells how each ended.
# Uses the script's own say.

JOB_LOGS=$REPO/target/logs
declare -A JOB_NAMES=()

# Starts a command in the background, in a process group of its own: stopping it stops all that it started.
start_group() { # name, command…
  local name=$1
  shift
  set -m
  (set +m; "$@") </dev/null &
  set +m
  JOB_NAMES[$!]=$name
}

# Starts a command in the background; its output goes to target/logs/NAME.log.
start_job() { # name, command…
  mkdir -p "$JOB_LOGS"
  start_group "$1" logged_job "$@"
}

logged_job() { # name, command…
  local name=$1 began=$SECONDS status
  shift
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
  return "$status"
}

# Waits for all jobs. Fails if any has failed, after the others have ended.
wait_for_jobs() {
  local pid status=0
  for pid in "${!JOB_NAMES[@]}"; do wait "$pid" || status=1; done
  JOB_NAMES=()
  return "$status"
}

# A script that is stopped stops its jobs.
stop_jobs() {
  local pid
  for pid in "${!JOB_NAMES[@]}"; do kill -- "-$pid" 2>/dev/null || true; done
  exit 130
}
trap stop_jobs INT TERM
