# Sourced by other scripts, never run: installs system packages. Uses the script's own say and stop.

install_missing() { # function that lists the missing packages, advice…
  local packages missing=$1 as_root=()
  shift
  mapfile -t packages < <("$missing")
  if [ ${#packages[@]} -eq 0 ]; then return; fi
  if ! command -v apt-get >/dev/null; then
    stop "These are missing, and there is no apt-get to install them with: ${packages[*]}" \
      "Install your system's packages of them, then run this again." "$@"
  fi
  if [ "$(id -u)" -ne 0 ]; then
    as_root=(sudo -n)
    if ! "${as_root[@]}" true 2>/dev/null; then
      stop "These packages are missing, and installing them needs root: ${packages[*]}" \
        "Run: sudo apt-get install --no-install-recommends ${packages[*]}" "$@"
    fi
  fi
  say "installing ${packages[*]}"
  { "${as_root[@]}" apt-get update -qq &&
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
      apt-get install -y -qq --no-install-recommends "${packages[@]}"; } >&2 ||
    stop "apt-get could not install: ${packages[*]}" "$@"
  . "$REPO/pkg-scripts/env.sh"
  mapfile -t packages < <("$missing")
  [ ${#packages[@]} -eq 0 ] || stop "Still missing after installation: ${packages[*]}" \
    "Install them by hand, and put their commands on PATH." "$@"
}
