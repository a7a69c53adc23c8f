//! Decodes the photographs whose paths come by standard input, a line each, for `scripts/odd-images/measure`.
//!
//! Answers each with a line `ok COLUMNS ROWS` and the pixels (red, green, blue), or `error` and the reason.

use std::io::{BufRead, Result, Write, stdin, stdout};

use tropism::photo::Photo;

fn main() -> Result<()> {
    let mut out = stdout().lock();
    for path in stdin().lock().lines() {
        let path = path?;
        let photo = Photo { bytes: std::fs::read(&path)?, name: path, time_s: 0.0 };
        match photo.decode() {
            Ok(image) => {
                writeln!(out, "ok {} {}", image.width, image.height)?;
                out.write_all(&image.rgb)?;
            }
            Err(error) => writeln!(out, "error {}", error.to_string().replace('\n', " "))?,
        }
        out.flush()?;
    }
    Ok(())
}
