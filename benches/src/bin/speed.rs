//! What vision costs for a folder of photographs, in ms of CPU time each, decoding included; and the photographs.
//!
//! `speed draw FOLDER WIDTH COUNT` draws photographs of the virtual tent and prints the crop; `speed time FOLDER WIDTH`
//! prints the costs as JSON. Without arguments both are done for a few small photographs. `benches/opencv/compare.py` sets
//! the figures beside OpenCV's.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;

use cpu_time::ThreadTime;
use tropism::lamps::Light;
use tropism::photo::Photo;
use tropism::photo::jpeg::Jpeg;
use tropism::vision::{Frame, Mode, TipTracker, VisionConfig, lamp_state};
use tropism_bean::render::Renderer;
use tropism_bean::scene::Scene;
use tropism_bean::tent::Greenhouse;
use tropism_bean::{Bean, Species};

// As in the program `tropism`.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// A paper experiment: 1000 steps of five minutes.
const END_MIN: f64 = 5000.0;

fn greenhouse(width: u32) -> Greenhouse {
    Greenhouse { scene: Scene { width, height: width * 3 / 4, ..Scene::default() }, ..Greenhouse::default() }
}

fn draw(folder: &Path, width: u32, count: u64) -> Result<(), Box<dyn Error>> {
    let greenhouse = greenhouse(width);
    for seed in 0..count {
        let mut bean = Bean::new(Species::default().draw(seed, 1.0), seed);
        bean.advance(&[0.0, 1.0], END_MIN * (seed + 1) as f64 / count as f64);
        let mut renderer = Renderer::new(&greenhouse.scene, seed);
        let bytes = renderer.photograph(&bean.pose(), Some(Light::RIGHT), true, 0);
        std::fs::write(folder.join(format!("{seed:03}.jpg")), bytes)?;
    }
    let crop = greenhouse.crop();
    println!("[{}, {}, {}, {}]", crop.x, crop.y, crop.width, crop.height);
    Ok(())
}

fn time(folder: &Path, width: u32) -> Result<(), Box<dyn Error>> {
    let mut files: Vec<_> = std::fs::read_dir(folder)?.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    let photos: Vec<Photo> = files
        .into_iter()
        .map(|path| Ok(Photo { name: String::new(), bytes: std::fs::read(path)?, time_s: 0.0 }))
        .collect::<Result<_, std::io::Error>>()?;
    let greenhouse = greenhouse(width);
    // The second of two rounds is timed. Frames are made anew for each, for one that was read stays open.
    let cost = |work: &mut dyn FnMut(&Frame)| {
        let round = || -> Vec<Frame> { photos.iter().cloned().map(Frame::new).collect() };
        round().into_iter().for_each(|frame| work(&frame));
        let frames = round();
        let start = ThreadTime::now();
        frames.into_iter().for_each(|frame| work(&frame));
        1e3 * start.elapsed().as_secs_f64() / photos.len() as f64
    };
    let tracker = |mode, stem| {
        let config = VisionConfig { mode, stem, crop: Some(greenhouse.crop()), ..VisionConfig::default() };
        TipTracker::new(greenhouse.calibration(), config)
    };
    let (mut tip, mut paper, mut robust) =
        (tracker(Mode::Paper, false)?, tracker(Mode::Paper, true)?, tracker(Mode::Robust, true)?);
    let decode = cost(&mut |frame| drop(black_box(frame.photo().decode())));
    let floor = cost(&mut |frame| {
        black_box(Jpeg::scan_only(&frame.photo().bytes));
    });
    let lamp = cost(&mut |frame| {
        black_box(frame.picture().is_ok_and(|picture| lamp_state(picture, None).is_some()));
    });
    let see = |tracker: &mut TipTracker| {
        cost(&mut |frame| {
            black_box(tracker.observe(frame));
        })
    };
    let (tip, paper, robust) = (see(&mut tip), see(&mut paper), see(&mut robust));
    println!(
        "{{\"floor\": {floor:.3}, \"decode\": {decode:.3}, \"lit lamp\": {lamp:.3}, \"paper tip\": {tip:.3}, \"paper\": {paper:.3}, \"robust\": {robust:.3}}}"
    );
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["draw", folder, width, count] => draw(Path::new(folder), width.parse()?, count.parse()?),
        ["time", folder, width] => time(Path::new(folder), width.parse()?),
        [] => {
            let folder = tempfile::tempdir()?;
            draw(folder.path(), 648, 2)?;
            time(folder.path(), 648)
        }
        _ => Err("wanted draw FOLDER WIDTH COUNT, or time FOLDER WIDTH".into()),
    }
}
