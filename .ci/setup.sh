#!/usr/bin/env bash
# Brings a Debian 12 machine to the state in which `ribbonbench` runs: apt packages (only those that are missing, with
# sudo when not root), a venv .venv made from Debian's python3 with system site packages (dolfinx lives there), the
# pinned Python packages, and the project itself, editable.
#
# May be run any number of times, interrupted, and by two shells at once. Exit codes: 0 done, 3 something is missing
# that this script may not or cannot install. With the word "packages": the apt packages alone (Containerfile).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# What each package is for stands beside it; `ribbonbench doctor` names them again where something is missing.
PACKAGES=(
    python3 python3-venv                          # the interpreter that dolfinx belongs to
    python3-dolfinx python3-slepc4py              # the shell: FEniCSx, PETSc, SLEPc, MPI
    coinor-libipopt-dev pkg-config                # the ribbon: Ipopt, found by cyipopt's build
    gcc libc6-dev python3-dev                     # compile cyipopt, and dolfinx's forms at run time
    libegl1 libgl1-mesa-dri                       # pictures: VTK off screen (EGL, software rendering)
    chromium                                      # tests: HTML reports and their 3-D views, headless
)
PYTHON=/usr/bin/python3 # never the python3 on the PATH: only Debian's sees dolfinx
VENV=.venv
STAMP=$VENV/setup-complete     # written last: what was installed, and where
UNFINISHED=$VENV/setup-running # there while a set-up runs, and after one that was interrupted

say() { printf 'setup: %s\n' "$*"; }
missing() { # one line, exit code 3
    printf 'setup: %s\n' "$*" >&2
    exit 3
}

export LC_ALL=C.UTF-8
export PYTHONNOUSERSITE=1 # packages in the home folder neither count as installed nor shadow ours
unset PYTHONPATH PYTHONHOME PIP_TARGET PIP_PREFIX PIP_USER PIP_REQUIRE_VIRTUALENV VIRTUAL_ENV || true

# One set-up at a time in this folder; the lock goes with the process.
exec 9<Makefile
if ! flock --nonblock 9; then
    say "another set-up is running in this folder; waiting for it"
    flock 9
fi

# --- Debian packages -------------------------------------------------------------------------------------------------
command -v dpkg-query >/dev/null ||
    missing "this is not Debian (no dpkg); on another system install dolfinx, slepc4py and Ipopt yourself, see README.md"

absent() { # those of the arguments that are not installed, one per line
    local have
    have=" $(dpkg-query -W -f '${db:Status-Status} ${Package} ' "$@" 2>/dev/null | sed 's/installed \([^ ]*\)/+\1/g' || true) "
    local name
    for name in "$@"; do
        [[ $have == *" +$name "* ]] || printf '%s\n' "$name"
    done
}

mapfile -t needed < <(absent "${PACKAGES[@]}")
if ((${#needed[@]})); then
    install="apt-get install --no-install-recommends ${needed[*]}"
    root=()
    if [[ $(id -u) != 0 ]]; then
        command -v sudo >/dev/null || missing "neither root nor sudo here; as root run: $install"
        root=(sudo)
        [[ -t 0 && -z ${CI:-} ]] || root=(sudo -n) # nobody there to type a password
        "${root[@]}" true 2>/dev/null || missing "sudo refuses; as root run: $install"
    fi
    say "installing ${#needed[@]} Debian packages (about 2 GB on a bare machine, one to four minutes): ${needed[*]}"
    apt=("${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300)
    log=$(mktemp)
    trap 'rm -f "$log"' EXIT
    run_apt() { "${apt[@]}" "$@" >"$log" 2>&1 </dev/null 9<&-; }
    run_apt update || say "apt-get update did not succeed; trying with the package lists that are there"
    if ! run_apt install --yes --no-install-recommends "${needed[@]}"; then
        tail -n 25 "$log" >&2
        missing "apt-get failed (its last lines stand above); mend it, then run again: $install"
    fi
fi

[[ ${1-} != packages ]] || exit 0

# --- venv ------------------------------------------------------------------------------------------------------------
# The stamp: everything whose change calls for another installation. The folder belongs to it because a venv does not
# survive being moved.
wanted=$(
    echo "folder $PWD"
    echo "python $(readlink -f $PYTHON) $($PYTHON -c 'import sys; print(sys.version.split()[0])')"
    sha256sum .ci/requirements.lock .ci/build.lock .ci/backend.py pyproject.toml
)
usable() { # the venv runs, is ours, sees Debian's packages, and no set-up was interrupted in it
    [[ ! -e $UNFINISHED && -x $VENV/bin/python && -f $VENV/pyvenv.cfg ]] || return 1
    grep -q '^include-system-site-packages = true' "$VENV/pyvenv.cfg" || return 1
    [[ ! -f $STAMP ]] || grep -qxF "folder $PWD" "$STAMP" || return 1
    "$VENV/bin/python" -c 'import os, sys, pip
assert os.path.samefile(sys.prefix, ".venv")
assert os.path.realpath(sys.executable) == os.path.realpath("'$PYTHON'")' 2>/dev/null
}

if usable && [[ -x $VENV/bin/ribbonbench && -f $STAMP && $(<"$STAMP") == "$wanted" ]]; then
    say "nothing to do, the environment is in $VENV"
    exit 0
fi

if ! usable; then
    if [[ -e $VENV ]]; then
        say "making $VENV anew (it was interrupted, moved, or not made from $PYTHON)"
        rm -rf --one-file-system "$VENV"
    else
        say "making $VENV from $PYTHON"
    fi
    mkdir "$VENV"
    touch "$UNFINISHED"
    "$PYTHON" -m venv --system-site-packages "$VENV" 9<&- ||
        missing "$PYTHON could not make a venv; run: apt-get install --reinstall python3-venv, then again make setup"
fi
touch "$UNFINISHED"
rm -f "$STAMP"

# --- Python packages -------------------------------------------------------------------------------------------------
say "installing $(grep -c == .ci/requirements.lock) pinned Python packages into $VENV (one to three minutes the first time)"
pip() {
    # Builds (cyipopt, this project) use the same pins: constraints reach pip's isolated builds by the environment.
    PIP_CONSTRAINT=".ci/requirements.lock .ci/build.lock" \
        "$VENV/bin/python" -m pip --disable-pip-version-check --no-input "$@" --quiet </dev/null 9<&-
}
pip install --requirement <(grep -v '^cyipopt==' .ci/requirements.lock) &&
    # Built for the NumPy of this venv. pip would keep the wheel for every other venv, whatever NumPy that has, and
    # would take one here that another venv left.
    pip install --no-cache-dir --no-deps --no-binary cyipopt "$(grep '^cyipopt==' .ci/requirements.lock)" ||
    missing "pip could not install the Python packages (see above); check the network, then again: make setup"
pip install --no-deps --editable . ||
    missing "pip could not install ribbonbench itself (see above)"

printf '%s\n' "$wanted" >"$STAMP.new"
mv "$STAMP.new" "$STAMP"
rm -f "$UNFINISHED"
say "compiling the ribbon's kernels and the shell's forms, once (a minute or two; what is kept already takes seconds)"
"$VENV/bin/ribbonbench" doctor --warm >/dev/null 2>&1 </dev/null 9<&- ||
    say "that did not end well: the first solve compiles what it needs, and ribbonbench doctor says what is missing"
say "done, the environment is in $VENV; try: $VENV/bin/ribbonbench doctor"
