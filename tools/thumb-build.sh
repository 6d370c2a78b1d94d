#!/usr/bin/env bash
# Builds packages for a Cortex-M4F: tools/thumb-build.sh PACKAGE...
#
# With the standard library of that target if the toolchain has it or rustup can fetch it; otherwise
# with Debian's Rust, which brings the sources of `core` and compiles them here.
set -eu
cd "$(dirname "$0")/.."

target=thumbv7em-none-eabihf
export CARGO_TARGET_DIR=target/thumb

packages=()
for package in "$@"; do
  packages+=(-p "$package")
done

has_target() {
  local folder
  folder=$(rustc --print target-libdir --target $target 2>/dev/null) && [ -d "$folder" ]
}

if ! has_target && command -v rustup >/dev/null; then
  timeout 60 rustup target add $target || echo "rustup cannot fetch $target" >&2
fi
if has_target; then
  exec cargo build --locked --target $target "${packages[@]}"
fi

# Debian's own Rust lies in /usr beside whatever else is installed.
debian_core=/usr/lib/rustlib/src/rust/library/core
debian_packages=(rustc-web cargo-web rust-web-src)
if [ ! -d $debian_core ] || [ ! -x /usr/bin/cargo ]; then
  if ! command -v apt-get >/dev/null || [ "$(id -u)" -ne 0 ]; then
    echo "error: no Rust for $target; run one of" >&2
    echo "  rustup target add $target" >&2
    echo "  sudo apt-get install ${debian_packages[*]}" >&2
    exit 1
  fi
  echo "installing ${debian_packages[*]}"
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    "${debian_packages[@]}" >/dev/null
fi
export RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1
exec /usr/bin/cargo build --locked -Zbuild-std=core --target $target "${packages[@]}"
