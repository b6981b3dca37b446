#!/usr/bin/env bash
# Runs the shell's tests on Debian 13 (dolfinx 0.9), whatever Debian this machine has: in a chroot made by debootstrap.
#
#     .ci/debian13.sh [FOLDER [PYTEST ARGUMENTS]]
#
# FOLDER keeps the chroot for the next run (2.7 GB; three minutes the first time on an idle machine); without it, or with "", a
# temporary folder is used and deleted. PYTEST ARGUMENTS: what to run there, tests/shellref unless given. The files are
# those git knows or would add, as they are now. Needs root, debootstrap and a Debian mirror (this machine's own).
# Exit codes: pytest's, or 3 when the chroot cannot be made.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

PACKAGES=(
    python3-dolfinx python3-slepc4py mpi-default-bin # the shell
    python3-venv python3-pytest python3-scipy python3-numba python3-mpmath python3-hypothesis
    gcc libc6-dev python3-dev # compile dolfinx's forms at run time
)
WHEELS=(scikit-fem) # not in Debian; pure Python, in the version of the lock file

say() { printf 'debian13: %s\n' "$*"; }
missing() {
    say "$*" >&2
    exit 3
}

# Mounts live in a name space of this run: they end with it, however it ends, and nothing outside can walk into them.
if [[ ${1-} != --inside ]]; then
    [[ $(id -u) == 0 ]] || missing "must run as root (chroot)"
    command -v debootstrap >/dev/null || missing "debootstrap is missing: apt-get install debootstrap"
    exec unshare --mount --propagation private bash "${BASH_SOURCE[0]}" --inside "$@"
fi
shift

temporary=
if [[ -n ${1-} ]]; then
    mkdir -p "$1"
    folder=$(readlink -f "$1")
    shift
else
    (($# == 0)) || shift
    temporary=yes
    folder=$(mktemp -d)
fi
root=$folder/root
(($#)) || set -- tests/shellref

clean_up() {
    local point
    for point in dev/shm sys proc; do
        ! mountpoint -q "$root/$point" || umount "$root/$point"
    done
    if [[ $temporary ]]; then
        ! grep -q " $folder/" /proc/self/mounts || missing "$folder has mounts left; it is not deleted"
        rm -rf --one-file-system "$folder"
    fi
}
trap clean_up EXIT
trap 'exit 130' INT TERM HUP

# --- the chroot ------------------------------------------------------------------------------------------------------
in_chroot() {
    env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
        chroot "$root" "$@"
}
run_quietly() { # a command whose output is shown only when it fails
    "$@" >"$folder/log" 2>&1 </dev/null || {
        tail -n 25 "$folder/log" >&2
        missing "failed (last lines above): $*"
    }
}

if [[ ! -f $folder/made ]]; then
    # the mirror of this machine's own Debian, from either form of apt's lists
    mirror=$(cat /etc/apt/sources.list.d/*.sources /etc/apt/sources.list.d/*.list /etc/apt/sources.list 2>/dev/null |
        grep -oE '^(URIs:|deb) .*' | grep -oE 'https?://[^ ]+/debian/?( |$)' | head -n 1 || true)
    [[ $mirror ]] || missing "no Debian mirror in this machine's apt lists"
    say "making a Debian 13 in $root"
    ! grep -q " $root/" /proc/self/mounts || missing "$root has mounts; umount them first"
    rm -rf --one-file-system "$root"
    run_quietly debootstrap --variant=minbase --include=ca-certificates trixie "$root" "${mirror%% *}"
    touch "$folder/made"
fi
cp --dereference /etc/resolv.conf /etc/hosts "$root/etc/"
mount -t proc proc "$root/proc"
mount -t sysfs -o ro sysfs "$root/sys"
mkdir -p "$root/dev/shm"
mount -t tmpfs tmpfs "$root/dev/shm"

if [[ ! -f $folder/installed || $(<"$folder/installed") != "${PACKAGES[*]}" ]]; then
    say "installing ${PACKAGES[*]}"
    run_quietly in_chroot apt-get -qq update
    run_quietly in_chroot apt-get -qq install --yes --no-install-recommends "${PACKAGES[@]}"
    echo "${PACKAGES[*]}" >"$folder/installed"
fi

# --- the project -----------------------------------------------------------------------------------------------------
# Wheels come through this machine's pip, which knows its index.
python=.venv/bin/python
[[ -x $python ]] || python=python3
mkdir -p "$root/wheels"
for name in "${WHEELS[@]}"; do
    pinned=$(grep -E "^$name==" .ci/requirements.lock | grep -oE '^[^ ;\\]+')
    compgen -G "$root/wheels/${name/-/_}-${pinned#*==}-*.whl" >/dev/null ||
        run_quietly "$python" -m pip --disable-pip-version-check download --quiet --no-deps --dest "$root/wheels" "$pinned"
done
[[ -x $root/venv/bin/python ]] || run_quietly in_chroot python3 -m venv --system-site-packages /venv
run_quietly in_chroot sh -c '/venv/bin/pip install --quiet --no-index --no-deps /wheels/*.whl'

rm -rf --one-file-system "$root/project"
mkdir "$root/project"
git ls-files -z --cached --others --exclude-standard |
    while IFS= read -r -d '' file; do [[ ! -e $file ]] || printf '%s\0' "$file"; done |
    tar --create --null --files-from=- | tar --extract --directory "$root/project" --no-same-owner

say "python -m pytest $*"
in_chroot env OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 PYTHONNOUSERSITE=1 UCX_LOG_LEVEL=fatal HWLOC_HIDE_ERRORS=2 \
    sh -c 'cd /project
        /venv/bin/python -c "from shellref.fenics.dolfinx_api import versions; print(versions())" || exit 3
        exec /venv/bin/python -m pytest "$@"' sh "$@"
