#!/usr/bin/env bash
set -euo pipefail
cargo install --locked --no-track --root "$PREFIX" --path crates/tropism-cli
python scripts/notices "$(rustc -vV | sed -n 's/^host: //p')" > THIRD-PARTY.txt
mkdir -p "$PREFIX/share/man/man1" "$PREFIX/share/bash-completion/completions"
"$PREFIX/bin/tropism" --quiet man --out "$PREFIX/share/man/man1"
"$PREFIX/bin/tropism" completions bash > "$PREFIX/share/bash-completion/completions/tropism"
