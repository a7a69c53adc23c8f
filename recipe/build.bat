cargo install --locked --no-track --root "%LIBRARY_PREFIX%" --path crates\tropism-cli || exit 1
python scripts\notices x86_64-pc-windows-msvc > THIRD-PARTY.txt || exit 1
