# Sourced by the other scripts, never run: finds the tools. Installs nothing and prints nothing; the variable of a
# missing tool stays empty, and pkg-scripts/setup installs the tool.

REPO=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
CACHE=${XDG_CACHE_HOME:-$HOME/.cache}/relightable-photo

# Scripts and tests expect cargo's output here, whatever the user's own settings say.
export CARGO_TARGET_DIR="$REPO/target"

# rustup's folder, for shells that were started before rustup was installed.
[ -d "${CARGO_HOME:-$HOME/.cargo}/bin" ] && PATH="$PATH:${CARGO_HOME:-$HOME/.cargo}/bin"

# wasm-bindgen's crate and command work together only at the same version.
WASM_BINDGEN_VERSION=$(awk '/^name = "wasm-bindgen"$/ { getline; gsub(/version = |"/, ""); print; exit }' "$REPO/Cargo.lock")
WASM_BINDGEN_ROOT=$CACHE/wasm-bindgen-$WASM_BINDGEN_VERSION
PATH="$WASM_BINDGEN_ROOT/bin:$PATH"
export PATH

# Every worker has a stack of its own: a quarter of the linker's default is enough.
WASM_FLAGS="-C link-arg=-zstack-size=262144"
# Modules keep the paths of sources for messages: those of crates without the folders of the machine that compiled them.
# Flags are separated by spaces, so that a folder with one stays in the modules.
CRATE_SOURCES=${CARGO_HOME:-$HOME/.cargo}/registry/src
case $CRATE_SOURCES in
*[[:space:]]*) ;;
*) WASM_FLAGS+=" --remap-path-prefix=$CRATE_SOURCES=" ;;
esac

first_command() {
  local name
  for name; do
    if command -v "$name"; then return; fi
  done
}

# Prints a Python for Snakemake: 3.11 or later, with what makes virtual environments.
python_for_snakemake() {
  local name
  for name in python3.13 python3.12 python3.11 python3; do
    # Stands for a version manager's command as well, which may have no such Python behind.
    if "$name" -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
      command -v "$name"
      return
    fi
  done
}

# Prints the Python of a virtual environment with exactly these packages; makes the environment if it is missing.
python_with() { # name, packages…
  local name=$1 python environment
  shift
  python=$(first_command python3 python)
  environment=$CACHE/python-$name
  if [ "$(cat "$environment/.installed" 2>/dev/null)" != "$*" ]; then
    rm -rf "$environment"
    if [ -z "$python" ] || ! "$python" -m venv "$environment" >&2; then
      echo "Python cannot make an environment. On Debian: sudo apt-get install python3 python3-venv" >&2
      return 1
    fi
    if ! "$environment/bin/python" -m pip install --quiet --disable-pip-version-check "$@" >&2; then
      echo "These Python packages could not be installed: $*" >&2
      return 1
    fi
    echo "$*" >"$environment/.installed"
  fi
  echo "$environment/bin/python"
}

clang_targets_wasm() {
  # Some packages of clang lack its own headers.
  echo '#include <stddef.h>' |
    "$1" --target=wasm32-unknown-unknown -ffreestanding -x c -c - -o /dev/null 2>/dev/null
}

# Prints a clang that can target wasm32, and the matching llvm-ar.
find_wasm_c_tools() {
  local version clang ar
  for version in "" -22 -21 -20 -19 -18 -17 -16 -15 -14; do
    clang=$(command -v "clang$version") || continue
    clang_targets_wasm "$clang" || continue
    ar=$(first_command "llvm-ar$version" llvm-ar llvm-ar-{22,21,20,19,18,17,16,15,14})
    [ -n "$ar" ] && echo "$clang $ar" && return
  done
}

# These compile the C code of zstd. Values from the user's environment stay.
if [ -z "${CC_wasm32_unknown_unknown:-}" ] || [ -z "${AR_wasm32_unknown_unknown:-}" ]; then
  read -r CC_wasm32_unknown_unknown AR_wasm32_unknown_unknown < <(find_wasm_c_tools) || true
fi
export CC_wasm32_unknown_unknown AR_wasm32_unknown_unknown

# The modules compress at level 19, whose strategy is btultra2: zstd leaves out the others, as far as it can. A level
# with another strategy would write other bytes than the command line.
if [[ ${CFLAGS_wasm32_unknown_unknown:-} != *ZSTD_EXCLUDE_* ]]; then
  for strategy in DFAST GREEDY LAZY LAZY2 BTLAZY2 BTOPT; do
    CFLAGS_wasm32_unknown_unknown+=" -DZSTD_EXCLUDE_${strategy}_BLOCK_COMPRESSOR"
  done
fi
export CFLAGS_wasm32_unknown_unknown

CHROMIUM=${CHROMIUM:-$(first_command chromium chromium-browser google-chrome google-chrome-stable)}
HEADLESS_SHELL=${HEADLESS_SHELL:-$(first_command chromium-headless-shell chrome-headless-shell)}
CHROMEDRIVER=${CHROMEDRIVER:-$(first_command chromedriver chromium.chromedriver)}
FIREFOX=${FIREFOX:-$(first_command firefox-esr firefox)}
WEBKIT_DRIVER=${WEBKIT_DRIVER:-$(first_command WebKitWebDriver)}
# Without a screen neither has a graphics device: both run on a virtual one.
if ! command -v Xvfb >/dev/null; then FIREFOX='' WEBKIT_DRIVER=''; fi
export CHROMIUM HEADLESS_SHELL CHROMEDRIVER FIREFOX WEBKIT_DRIVER
