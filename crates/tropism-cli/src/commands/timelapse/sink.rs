//! Where a film goes: into a GIF, to ffmpeg, or nowhere.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, bail, ensure};
use tropism::photo::Image;
use tropism_report::{Animation, Film};

/// Where a film goes.
pub(super) enum Sink {
    Gif(Box<Animation<BufWriter<File>>>),
    Mp4(Child),
    Nowhere,
}

impl Sink {
    /// A film of a `form`, such as the `samples` and with `fps` pictures a second, into the file `part`.
    pub(super) fn new(form: &str, part: &Path, samples: &[Image], film: &Film, fps: u16) -> Result<Self> {
        match form {
            "gif" => {
                let file = BufWriter::new(File::create(part)?);
                Ok(Self::Gif(Box::new(Animation::new(file, samples, film)?)))
            }
            "mp4" => {
                // The folder is tried first: what ffmpeg says of one that is not there is long.
                File::create(part)?;
                ffmpeg(part, (samples[0].width, samples[0].height), fps).map(Self::Mp4)
            }
            _ => Ok(Self::Nowhere),
        }
    }

    /// Adds a picture, shown for `delay` hundredths of a second if the form can do that.
    pub(super) fn add(&mut self, image: &Image, delay: u16) -> Result<()> {
        match self {
            Self::Gif(animation) => Ok(animation.add(image, delay)?),
            Self::Mp4(child) => {
                let stdin = child.stdin.as_mut().context("ffmpeg has ended")?;
                match stdin.write_all(&image.rgb) {
                    // It has ended; what it has to say is read at the end.
                    Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
                    other => Ok(other?),
                }
            }
            Self::Nowhere => Ok(()),
        }
    }

    /// Ends without a film: nobody writes into the file any more.
    pub(super) fn give_up(self) {
        if let Self::Mp4(mut child) = self {
            let _ = child.kill();
            let _ = child.wait();
        }
    }

    /// Ends the film.
    pub(super) fn finish(self) -> Result<()> {
        match self {
            Self::Gif(animation) => Ok(animation.finish()?.flush()?),
            Self::Mp4(mut child) => {
                drop(child.stdin.take());
                let mut complaint = String::new();
                if let Some(mut stderr) = child.stderr.take() {
                    stderr.read_to_string(&mut complaint)?;
                }
                let status = child.wait()?;
                let complaint = complaint.trim().replace('\n', "; ");
                ensure!(status.success(), "ffmpeg: ended with {status}: {complaint}");
                Ok(())
            }
            Self::Nowhere => Ok(()),
        }
    }
}

/// Starts ffmpeg: raw pictures on its standard input, an MP4 that every player plays in `file`.
fn ffmpeg(file: &Path, (width, height): (usize, usize), fps: u16) -> Result<Child> {
    let mut command = Command::new("ffmpeg");
    command.args(["-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
    command.args(["-s", &format!("{width}x{height}"), "-r", &fps.to_string(), "-i", "-"]);
    command.args(["-an", "-c:v", "libx264", "-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]);
    command.args(["-f", "mp4"]).arg(file);
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    match command.spawn() {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            bail!("found no ffmpeg on the PATH, wanted it for .mp4; a .gif needs nothing")
        }
        other => other.context("ffmpeg: cannot start"),
    }
}
