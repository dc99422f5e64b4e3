//! The frames as one file that players open: Motion JPEG in an AVI container.
//!
//! Each frame is a whole JPEG, so any frame can be sought, and players know the container since the nineties. The
//! layout follows Microsoft's "AVI RIFF File Reference": a `RIFF` of headers (`hdrl`), frames (`movi`) and an
//! index (`idx1`); the sizes in the headers are filled in at the end.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Bytes of frames after which the next file begins: players of the first AVI form read no further than 2^31 bytes, and
/// the index follows.
const MAX_BYTES: u64 = 2_000_000_000;
const HEADER_BYTES: usize = 224;

/// Writes the frames into as many files as their sizes ask for.
#[derive(Debug)]
pub struct VideoFiles {
    first: PathBuf,
    rate_hz: f64,
    max_bytes: u64,
    /// The file that is being written, and its number from 1.
    open: Option<VideoWriter>,
    files: u32,
}

impl VideoFiles {
    /// A video whose first file is `first`: `video.avi`, then `video-2.avi`.
    pub fn new(first: PathBuf, rate_hz: f64) -> Self {
        Self { first, rate_hz, max_bytes: MAX_BYTES, open: None, files: 0 }
    }

    /// Adds a frame, coded as JPEG.
    ///
    /// # Errors
    /// What the system says.
    pub fn add(&mut self, width: usize, height: usize, jpeg: &[u8]) -> io::Result<()> {
        let max_bytes = self.max_bytes;
        if let Some(full) = self.open.take_if(|video| !video.has_room(jpeg, max_bytes)) {
            full.finish()?;
        }
        let video = match &mut self.open {
            Some(video) => video,
            None => {
                self.files += 1;
                let path = match self.files {
                    1 => self.first.clone(),
                    number => {
                        let stem = self.first.file_stem().unwrap_or_default().to_string_lossy();
                        self.first.with_file_name(format!("{stem}-{number}.avi"))
                    }
                };
                self.open.insert(VideoWriter::create(&path, width, height, self.rate_hz)?)
            }
        };
        video.add(jpeg)
    }

    /// Completes the last file.
    ///
    /// # Errors
    /// What the system says.
    pub fn finish(self) -> io::Result<()> {
        self.open.map_or(Ok(()), VideoWriter::finish)
    }
}

/// Writes one file frame by frame.
#[derive(Debug)]
struct VideoWriter {
    file: BufWriter<File>,
    width: usize,
    height: usize,
    rate_hz: f64,
    /// Offset (from `movi`) and size of each frame.
    index: Vec<(u32, u32)>,
    written: u64,
    largest: u32,
}

impl VideoWriter {
    /// Starts a video of frames of one size.
    ///
    /// # Errors
    /// What the system says.
    pub fn create(path: &Path, width: usize, height: usize, rate_hz: f64) -> io::Result<Self> {
        let mut file = BufWriter::new(File::create(path)?);
        // Filled in by `finish`.
        file.write_all(&[0; HEADER_BYTES])?;
        Ok(Self { file, width, height, rate_hz, index: Vec::new(), written: 0, largest: 0 })
    }

    /// Whether another frame leaves the file below a size. The first one always fits.
    fn has_room(&self, jpeg: &[u8], max_bytes: u64) -> bool {
        self.index.is_empty() || self.written + jpeg.len() as u64 <= max_bytes
    }

    /// Adds a frame, coded as JPEG.
    ///
    /// # Errors
    /// What the system says.
    pub fn add(&mut self, jpeg: &[u8]) -> io::Result<()> {
        // Below two gigabytes, as the caller sees to.
        let size = jpeg.len() as u32;
        self.index.push((4 + self.written as u32, size));
        self.file.write_all(b"00dc")?;
        self.file.write_all(&size.to_le_bytes())?;
        self.file.write_all(jpeg)?;
        if jpeg.len() % 2 == 1 {
            self.file.write_all(&[0])?;
        }
        self.written += 8 + jpeg.len().next_multiple_of(2) as u64;
        self.largest = self.largest.max(size);
        Ok(())
    }

    /// Writes the index and fills in the headers.
    ///
    /// # Errors
    /// What the system says.
    pub fn finish(mut self) -> io::Result<()> {
        let index_bytes = 16 * self.index.len() as u32;
        self.file.write_all(b"idx1")?;
        self.file.write_all(&index_bytes.to_le_bytes())?;
        for (offset, size) in &self.index {
            self.file.write_all(b"00dc")?;
            // A key frame, as every frame is.
            for word in [0x10, *offset, *size] {
                self.file.write_all(&word.to_le_bytes())?;
            }
        }
        let movi = 4 + self.written as u32;
        let header = self.header(movi, index_bytes);
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&header)?;
        self.file.flush()
    }

    fn header(&self, movi: u32, index_bytes: u32) -> Vec<u8> {
        let frames = self.index.len() as u32;
        let (width, height) = (self.width as u32, self.height as u32);
        // Frames a second as a quotient with three decimals.
        let (rate, scale) = ((self.rate_hz * 1000.0).round().clamp(1.0, 4e9) as u32, 1000);
        let micros = (1e6 / self.rate_hz).round().clamp(1.0, 4e9) as u32;
        let mut out = Vec::with_capacity(HEADER_BYTES);
        let tag = |out: &mut Vec<u8>, name: &[u8; 4]| out.extend_from_slice(name);
        let words = |out: &mut Vec<u8>, values: &[u32]| {
            values.iter().for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
        };
        tag(&mut out, b"RIFF");
        words(&mut out, &[HEADER_BYTES as u32 - 12 + movi - 4 + 4 + 8 + index_bytes]);
        tag(&mut out, b"AVI ");
        tag(&mut out, b"LIST");
        words(&mut out, &[4 + 64 + 124]);
        tag(&mut out, b"hdrl");
        tag(&mut out, b"avih");
        // Has an index; one stream.
        words(
            &mut out,
            &[56, micros, self.largest.saturating_mul(rate / scale), 0, 0x10, frames, 0, 1, self.largest],
        );
        words(&mut out, &[width, height, 0, 0, 0, 0]);
        tag(&mut out, b"LIST");
        words(&mut out, &[4 + 64 + 48]);
        tag(&mut out, b"strl");
        tag(&mut out, b"strh");
        words(&mut out, &[56]);
        tag(&mut out, b"vids");
        tag(&mut out, b"MJPG");
        words(&mut out, &[0, 0, 0, scale, rate, 0, frames, self.largest, u32::MAX, 0, 0]);
        words(&mut out, &[(height & 0xffff) << 16 | (width & 0xffff)]);
        tag(&mut out, b"strf");
        words(&mut out, &[40, 40, width, height, 24 << 16 | 1]);
        tag(&mut out, b"MJPG");
        words(&mut out, &[width * height * 3, 0, 0, 0, 0]);
        tag(&mut out, b"LIST");
        words(&mut out, &[movi]);
        tag(&mut out, b"movi");
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_video_goes_on_in_the_next_file() {
        let folder = tempfile::tempdir().unwrap();
        let mut video =
            VideoFiles { max_bytes: 2_500, ..VideoFiles::new(folder.path().join("video.avi"), 30.0) };
        let frames: Vec<Vec<u8>> = (0..7_u8).map(|number| vec![number; 1_000]).collect();
        for frame in &frames {
            video.add(8, 6, frame).unwrap();
        }
        video.finish().unwrap();
        let mut found = Vec::new();
        for name in ["video.avi", "video-2.avi", "video-3.avi", "video-4.avi"] {
            let bytes = std::fs::read(folder.path().join(name)).unwrap();
            let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
            assert_eq!((&bytes[..4], word(4) + 8), (&b"RIFF"[..], bytes.len()), "{name}");
            let frames = word(48);
            for frame in 0..frames {
                let at = HEADER_BYTES + frame * 1_008;
                assert_eq!((&bytes[at..at + 4], word(at + 4)), (&b"00dc"[..], 1_000), "{name}");
                found.push(bytes[at + 8..at + 1_008].to_vec());
            }
        }
        assert_eq!(found, frames);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
    }
}
