//! Where a film goes: into a GIF, to ffmpeg, or nowhere.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use tropism::photo::Image;
use tropism_report::{Animation, Film};

use crate::error::Error;

/// What is made of the photographs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Gif,
    Mp4,
    /// No film.
    Composite,
}

impl Format {
    /// The format of the file `out`, by its extension.
    pub(super) fn of(out: &Path) -> Result<Self, Error> {
        let extension = out.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match extension.as_str() {
            "gif" => Ok(Self::Gif),
            "mp4" => Ok(Self::Mp4),
            "jpg" | "jpeg" => Ok(Self::Composite),
            _ => Err(Error::Plan(format!("`out` {}: wanted .gif, .mp4 or .jpg", out.display()))),
        }
    }

    pub(super) const fn extension(self) -> &'static str {
        match self {
            Self::Gif => "gif",
            Self::Mp4 => "mp4",
            Self::Composite => "jpg",
        }
    }
}

/// A film that is being written.
pub(super) enum Sink {
    Gif(Box<Animation<BufWriter<File>>>),
    /// ffmpeg, which reads pictures from its standard input.
    Mp4(Child),
    /// Nowhere: the composite alone is made.
    None,
}

type Failure = Box<dyn std::error::Error + Send + Sync>;

impl Sink {
    /// Creates a film in the file `part`, with pictures such as the `samples`, `fps` a second.
    pub(super) fn create(
        format: Format,
        part: &Path,
        samples: &[Image],
        film: &Film,
        fps: u16,
    ) -> Result<Self, Failure> {
        match format {
            Format::Gif => {
                let file = BufWriter::new(File::create(part)?);
                Ok(Self::Gif(Box::new(Animation::new(file, samples, film)?)))
            }
            Format::Mp4 => {
                // Fails early if the folder is missing, with a shorter message than ffmpeg's.
                File::create(part)?;
                let started = ffmpeg(part, (samples[0].width, samples[0].height), fps);
                started.map(Self::Mp4).inspect_err(|_| {
                    // An empty film is of no use.
                    let _ = std::fs::remove_file(part);
                })
            }
            Format::Composite => Ok(Self::None),
        }
    }

    /// Adds a picture, shown for `delay` hundredths of a second; an MP4 shows all pictures for the same time.
    pub(super) fn add(&mut self, image: &Image, delay: u16) -> Result<(), Failure> {
        match self {
            Self::Gif(animation) => Ok(animation.add(image, delay)?),
            Self::Mp4(child) => {
                let stdin = child.stdin.as_mut().ok_or("ffmpeg has ended")?;
                match stdin.write_all(&image.rgb) {
                    // ffmpeg has ended; its message is read at the end.
                    Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
                    other => Ok(other?),
                }
            }
            Self::None => Ok(()),
        }
    }

    /// Ends without a film: nothing writes into its file any more.
    pub(super) fn abandon(self) {
        if let Self::Mp4(mut child) = self {
            let _ = child.kill();
            let _ = child.wait();
        }
    }

    /// Ends the film.
    pub(super) fn finish(self) -> Result<(), Failure> {
        match self {
            Self::Gif(animation) => Ok(animation.finish()?.flush()?),
            Self::Mp4(mut child) => {
                drop(child.stdin.take());
                let mut message = String::new();
                if let Some(mut stderr) = child.stderr.take() {
                    stderr.read_to_string(&mut message)?;
                }
                let status = child.wait()?;
                let message = message.trim().replace('\n', "; ");
                if status.success() {
                    Ok(())
                } else {
                    Err(format!("ffmpeg: ended with {status}: {message}").into())
                }
            }
            Self::None => Ok(()),
        }
    }
}

/// Starts ffmpeg, which makes an MP4 with H.264 in 4:2:0, the format that every player shows, of raw pictures.
fn ffmpeg(file: &Path, (width, height): (usize, usize), fps: u16) -> Result<Child, Failure> {
    let mut command = Command::new("ffmpeg");
    command.args(["-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
    command.args(["-s", &format!("{width}x{height}"), "-r", &fps.to_string(), "-i", "-"]);
    command.args(["-an", "-c:v", "libx264", "-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]);
    command.args(["-f", "mp4"]).arg(file);
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    match command.spawn() {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            Err(".mp4 needs ffmpeg, which is not on the PATH; a .gif needs nothing".into())
        }
        Err(error) => Err(format!("ffmpeg: cannot start: {error}").into()),
        Ok(child) => Ok(child),
    }
}
