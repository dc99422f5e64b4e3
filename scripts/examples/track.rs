//! From PNG frames and the constants of a sensor to its pose and wrench, as a robot's program does it.
//!
//!     cargo run --release --example track -- constants.json frame_0000.png frame_0001.png

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use domecast::track::{CameraFrame, TrackOptions};
use domecast::{Constants, Tracker};

/// Width, height, channels and bytes of a picture.
type Picture = (usize, usize, usize, Vec<u8>);

fn read(path: &str) -> Result<Picture, Box<dyn std::error::Error>> {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path)?)).read_info()?;
    let mut bytes = vec![0; reader.output_buffer_size().ok_or("too large")?];
    let info = reader.next_frame(&mut bytes)?;
    Ok((info.width as usize, info.height as usize, info.color_type.samples(), bytes))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [constants, frames @ ..] = arguments.as_slice() else {
        return Err("usage: track CONSTANTS PNG..".into());
    };

    let mut tracker = Tracker::new(&Constants::load(Path::new(constants))?, TrackOptions::default())?;
    for (number, path) in frames.iter().enumerate() {
        let (width, height, channels, bytes) = read(path)?;
        let tracked = tracker.track(number as u64, &CameraFrame::new(width, height, channels, &bytes)?);
        print!("{path}: {}", tracked.status());
        // a frame without pose or wrench says why in its status
        if let (Some(pose), Some(wrench)) = (tracked.pose, tracked.wrench) {
            print!(", force {:.3} N, platform moved {:.3} mm", wrench.force_n, pose.translation_mm);
        }
        println!();
    }
    Ok(())
}
