#!/bin/sh
# Installs the latest release of tropism for this user, without root:
#
#   curl -fsSL https://github.com/OWNER/tropism/releases/latest/download/install.sh | sh
#
# The archive must have the SHA-256 that the release lists. TROPISM_VERSION (such as 0.1.0) asks for another release, TROPISM_TO
# for another folder than ~/.local, TROPISM_FROM for another address that holds the archive and SHA256SUMS.
set -eu

# All in a function: a download that is cut in the middle does nothing.
main() {
  address=https://github.com/OWNER/tropism
  to=${TROPISM_TO:-$HOME/.local}
  if [ -n "${TROPISM_VERSION:-}" ]; then from=$address/releases/download/v$TROPISM_VERSION; else from=$address/releases/latest/download; fi
  from=${TROPISM_FROM:-$from}

  case $(uname -s) in
    Linux) system=unknown-linux-musl ;;
    Darwin) system=apple-darwin ;;
    *) fail "no program for $(uname -s); on Windows download the archive: $address/releases" ;;
  esac
  case $(uname -m) in
    x86_64 | amd64) machine=x86_64 ;;
    aarch64 | arm64) machine=aarch64 ;;
    *) fail "no program for the processor $(uname -m); build it: cargo install tropism-cli" ;;
  esac
  archive=tropism-$machine-$system.tar.gz

  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  download "$from/$archive" "$work/$archive"
  download "$from/SHA256SUMS" "$work/SHA256SUMS"
  wanted=$(sed -n "s/^\([0-9a-f]\{64\}\)  *[*]\{0,1\}$archive\$/\1/p" "$work/SHA256SUMS")
  [ -n "$wanted" ] || fail "$from/SHA256SUMS does not list $archive"
  found=$(sha256 "$work/$archive")
  [ "$found" = "$wanted" ] || fail "$archive has the SHA-256 $found, the release says $wanted: nothing was installed"

  tar -xzf "$work/$archive" -C "$work"
  unpacked=$work/${archive%.tar.gz}
  mkdir -p "$to/bin" "$to/share/man/man1" "$to/share/bash-completion/completions" "$to/share/fish/vendor_completions.d"
  # By a new name first: a program that runs is replaced whole.
  cp "$unpacked/tropism" "$to/bin/.tropism.new"
  chmod 755 "$to/bin/.tropism.new"
  # One that does not run here replaces nothing.
  version=$("$to/bin/.tropism.new" --version) || { rm -f "$to/bin/.tropism.new"; fail "the program does not run here: nothing was replaced"; }
  mv -f "$to/bin/.tropism.new" "$to/bin/tropism"
  cp "$unpacked"/man/*.1 "$to/share/man/man1/"
  cp "$unpacked/completions/tropism.bash" "$to/share/bash-completion/completions/tropism"
  cp "$unpacked/completions/tropism.fish" "$to/share/fish/vendor_completions.d/"

  echo "$version is in $to/bin"
  case :$PATH: in
    *":$to/bin:"*) ;;
    *) echo "add it to the path: export PATH=\"$to/bin:\$PATH\"" ;;
  esac
  echo "next: tropism study --quick"
}

download() { # ADDRESS FILE
  if command -v curl >/dev/null; then
    curl -fsSL --retry 3 -o "$2" "$1" || fail "cannot download $1"
  elif command -v wget >/dev/null; then
    wget -q -O "$2" "$1" || fail "cannot download $1"
  else
    fail "neither curl nor wget is installed"
  fi
}

sha256() {
  if command -v sha256sum >/dev/null; then sha256sum "$1"; else shasum -a 256 "$1"; fi | cut -d ' ' -f 1
}

fail() {
  echo "install: $*" >&2
  exit 1
}

main
