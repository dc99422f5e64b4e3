//! Recorded frames, played at their times with the faults of cameras.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use super::player_options::PlayerOptions;
use super::{ArrivedFrame, FrameData, LiveSource, SourceInfo, SourceLost};
use crate::decode::{Picture, PictureFormat, picture};
use crate::frame_files::{numbered, pictures_in, read_whole};
use domecast_optics::numeric::SeededRandom;

/// Bytes of pictures that are kept once they are decoded.
const MAX_KEPT_BYTES: usize = 1 << 29;

/// A file of the folder.
struct Recorded {
    path: PathBuf,
    /// Its bytes and its picture, once they are read and as long as there is room.
    kept: Option<(Arc<[u8]>, Arc<Picture>)>,
}

/// Plays a folder of PNG or JPEG frames as a camera would give them. JPEG comes as it is, as from a camera of Motion JPEG;
/// PNG, which no camera sends, is decoded before its time, so that an age has none of it.
pub struct Player {
    files: Vec<Recorded>,
    options: PlayerOptions,
    info: SourceInfo,
    began: Instant,
    next: u64,
    gone_until: Option<Instant>,
    kept_bytes: usize,
}

impl Player {
    /// Opens a folder.
    ///
    /// # Errors
    /// A folder that cannot be read or has no frame.
    pub fn open(folder: &Path, options: PlayerOptions) -> Result<Self, String> {
        let files = pictures_in(folder).map_err(|error| format!("cannot be read ({error})"))?;
        if files.is_empty() {
            return Err("holds no PNG or JPEG frame".into());
        }
        let files = numbered(files).into_iter().map(|(_, path)| Recorded { path, kept: None }).collect();
        let mut player = Self {
            files,
            info: SourceInfo {
                name: folder.display().to_string(),
                format: "files",
                rate_hz: Some(options.rate_hz),
                ..SourceInfo::default()
            },
            options,
            began: Instant::now(),
            next: 0,
            gone_until: None,
            kept_bytes: 0,
        };
        let first = player.read(0)?.1;
        player.info.size = Some([first.width, first.height]);
        for index in 1..player.files.len() {
            if player.kept_bytes > MAX_KEPT_BYTES {
                break;
            }
            // one that cannot be read is a damaged frame when its time comes
            let _ = player.read(index);
        }
        player.began = Instant::now();
        Ok(player)
    }

    /// A frame's bytes and picture.
    fn read(&mut self, index: usize) -> Result<(Arc<[u8]>, Arc<Picture>), String> {
        let file = &mut self.files[index];
        if let Some((bytes, picture)) = &file.kept {
            return Ok((Arc::clone(bytes), Arc::clone(picture)));
        }
        let named = |problem: String| format!("{}: {problem}", file.path.display());
        let bytes = read_whole(&file.path).map_err(|error| named(format!("cannot be read ({error})")))?;
        let decoded = Arc::new(picture(&bytes).map_err(named)?);
        let bytes: Arc<[u8]> = bytes.into();
        if self.kept_bytes <= MAX_KEPT_BYTES {
            self.kept_bytes += bytes.len() + decoded.bytes.len();
            file.kept = Some((Arc::clone(&bytes), Arc::clone(&decoded)));
        }
        Ok((bytes, decoded))
    }

    /// The file of a frame: back and forth, so that nothing jumps.
    fn index(&self, number: u64) -> usize {
        let last = self.files.len() as u64 - 1;
        if last == 0 {
            return 0;
        }
        let at = number % (2 * last);
        at.min(2 * last - at) as usize
    }

    /// What a frame shows, with its faults.
    fn data(&mut self, number: u64, chance: &mut SeededRandom) -> (FrameData, Option<Arc<[u8]>>) {
        let is_repeated = chance.uniform() < self.options.repeat && number > 0;
        let is_torn = chance.uniform() < self.options.tear && number > 0;
        let row_share = chance.between(0.2, 0.8);
        let shown = if is_repeated { number - 1 } else { number };
        let (bytes, decoded) = match self.read(self.index(shown)) {
            Ok(read) => read,
            Err(problem) => return (FrameData::Damaged(problem), None),
        };
        if is_torn
            && !is_repeated
            && let Ok((_, last)) = self.read(self.index(number - 1))
            && last.bytes.len() == decoded.bytes.len()
        {
            let row_bytes = decoded.width * decoded.channels;
            let upper = (decoded.height as f64 * row_share) as usize * row_bytes;
            let mut torn = (*decoded).clone();
            torn.bytes[..upper].copy_from_slice(&last.bytes[..upper]);
            return (FrameData::Pixels(Arc::new(torn)), None);
        }
        match PictureFormat::of(&bytes) {
            Some(PictureFormat::Jpeg) => (FrameData::Jpeg(Arc::clone(&bytes)), Some(bytes)),
            Some(PictureFormat::Png) => (FrameData::Pixels(decoded), Some(bytes)),
            None => (FrameData::Pixels(decoded), None),
        }
    }

    fn due(&self, number: u64) -> Instant {
        self.began + Duration::from_secs_f64(number as f64 / self.options.rate_hz)
    }
}

fn sleep_until(due: Instant) {
    if let Some(wait) = due.checked_duration_since(Instant::now()) {
        thread::sleep(wait);
    }
}

impl LiveSource for Player {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<ArrivedFrame>, SourceLost> {
        loop {
            let number = self.next;
            let count = self.options.frames.unwrap_or(self.files.len() as u64);
            if number >= count {
                return Ok(None);
            }
            if self.gone_until.is_some() {
                return Err(SourceLost("the device is gone".into()));
            }
            if self.options.unplug.contains(&number) {
                sleep_until(self.due(number));
                self.gone_until = Some(Instant::now() + Duration::from_secs_f64(self.options.unplug_s));
                return Err(SourceLost("the device is gone".into()));
            }
            self.next += 1;
            // of the frame's own stream: the faults of one frame are the same whatever the others do
            let mut chance = SeededRandom::stream(self.options.seed, number);
            if chance.uniform() < self.options.drop {
                continue;
            }
            let late_ms = if chance.uniform() < self.options.delay { self.options.delay_ms } else { 0.0 };
            let (data, file) = self.data(number, &mut chance);
            let due = self.due(number) + Duration::from_secs_f64(1e-3 * late_ms);
            sleep_until(due);
            let time_s = number as f64 / self.options.rate_hz;
            return Ok(Some(ArrivedFrame { number, time_s, complete: due, data, file }));
        }
    }

    fn reopen(&mut self) -> Result<(), SourceLost> {
        if self.gone_until.is_some_and(|until| until > Instant::now()) {
            return Err(SourceLost("the device is gone".into()));
        }
        if self.gone_until.take().is_some() {
            // what was shown while it was gone never came; the frame that it went with is not gone with again
            let passed_s = self.began.elapsed().as_secs_f64();
            self.next = self.next.max((passed_s * self.options.rate_hz).ceil() as u64 + 1);
        }
        Ok(())
    }
}
