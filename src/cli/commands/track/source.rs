//! Where frames come from: files, a video through ffmpeg, a stream.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::str::FromStr;

use super::super::input::input_fault;
use super::super::output::Failure;
use domecast_live::decode::{self, Picture};
use domecast_live::frame_files::{has_extension, numbered, pictures_in, read_whole};

const VIDEOS: [&str; 8] = ["avi", "mp4", "mkv", "mov", "webm", "m4v", "mjpeg", "mpg"];
const ALLOWED: &str = "a folder of PNG or JPEG frames, frames, one video, or - for a stream";

/// Size and channels of raw frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawSize {
    width: usize,
    height: usize,
    channels: usize,
    is_blue_first: bool,
}

impl FromStr for RawSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || "WIDTHxHEIGHT:gray, WIDTHxHEIGHT:rgb or WIDTHxHEIGHT:bgr, such as 640x480:rgb".to_owned();
        let (size, kind) = text.split_once(':').unwrap_or((text, "gray"));
        let (width, height) = size.split_once('x').ok_or_else(wrong)?;
        let number =
            |t: &str| t.parse::<usize>().ok().filter(|v| (1..=1 << 14).contains(v)).ok_or_else(wrong);
        let channels = match kind {
            "gray" | "grey" => 1,
            "rgb" | "bgr" => 3,
            _ => return Err(wrong()),
        };
        Ok(Self { width: number(width)?, height: number(height)?, channels, is_blue_first: kind == "bgr" })
    }
}

/// A frame, or why there is none.
pub struct NextFrame {
    pub number: u64,
    pub picture: Result<Picture, String>,
    /// The bytes of its file, where it has one.
    pub encoded: Option<Vec<u8>>,
}

enum Kind {
    Files(std::vec::IntoIter<(u64, PathBuf)>),
    Raw(Box<dyn Read>, RawSize),
    Pnm(Box<dyn Read>),
}

/// Frames, one after the other.
pub struct FrameSource {
    kind: Kind,
    next: u64,
    done: bool,
    video: Option<(Child, PathBuf)>,
    /// The bytes of a frame that is done with: a new one of that size needs no new memory.
    scratch: Vec<u8>,
}

impl FrameSource {
    /// Opens what the command line names.
    pub fn open(paths: &[PathBuf], raw: Option<RawSize>) -> Result<Self, Failure> {
        let of = |kind: Kind| Self { kind, next: 0, done: false, video: None, scratch: Vec::new() };
        let [path, more @ ..] = paths else {
            return Err(input_fault(Path::new("-"), "nothing was given", ALLOWED));
        };
        let is_stream = path.as_os_str() == "-";
        if (is_stream || raw.is_some() || has_extension(path, &VIDEOS)) && !more.is_empty() {
            return Err(input_fault(path, "stands beside others", ALLOWED));
        }
        if is_stream || raw.is_some() {
            let stream: Box<dyn Read> = if is_stream {
                Box::new(BufReader::new(io::stdin()))
            } else {
                Box::new(BufReader::new(File::open(path).map_err(|e| unreadable(path, &e))?))
            };
            return Ok(of(match raw {
                Some(size) => Kind::Raw(stream, size),
                None => Kind::Pnm(stream),
            }));
        }
        if has_extension(path, &VIDEOS) {
            return Self::video(path);
        }
        // a name that the user gave must be there; a file that cannot be read later on is one lost frame
        for named in paths {
            named.metadata().map_err(|error| unreadable(named, &error))?;
        }
        let files = if path.is_dir() && more.is_empty() { pictures_of(path)? } else { paths.to_vec() };
        Ok(of(Kind::Files(numbered(files).into_iter())))
    }

    fn video(path: &Path) -> Result<Self, Failure> {
        File::open(path).map_err(|e| unreadable(path, &e))?;
        // Pictures with a head each: their size is known, not guessed.
        let child = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "error", "-i"])
            .arg(path)
            .args(["-an", "-f", "image2pipe", "-c:v", "ppm", "-pix_fmt", "rgb24", "-"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn();
        let mut child = child.map_err(|error| {
            let problem = format!("is a video, and ffmpeg, which would read it, does not start ({error})");
            input_fault(path, problem, "a system with ffmpeg, or the frames as pictures")
        })?;
        let stream: Box<dyn Read> = match child.stdout.take() {
            Some(stdout) => Box::new(BufReader::new(stdout)),
            None => Box::new(io::empty()),
        };
        Ok(Self {
            kind: Kind::Pnm(stream),
            next: 0,
            done: false,
            video: Some((child, path.to_path_buf())),
            scratch: Vec::new(),
        })
    }

    /// The next frame; `None` at the end. After a stream that broke off there is nothing more.
    pub fn next_frame(&mut self) -> Option<NextFrame> {
        if self.done {
            return None;
        }
        let number = self.next;
        self.next += 1;
        match &mut self.kind {
            Kind::Files(files) => {
                let (number, path) = files.next()?;
                let encoded = read_whole(&path).map_err(|error| format!("cannot be read ({error})"));
                let picture =
                    encoded.as_ref().map_err(String::clone).and_then(|bytes| decode::picture(bytes));
                let picture = picture.map_err(|e| format!("{}: {e}", path.display()));
                Some(NextFrame { number, picture, encoded: encoded.ok() })
            }
            Kind::Raw(stream, size) => {
                let wanted = size.width * size.height * size.channels;
                let mut bytes = std::mem::take(&mut self.scratch);
                bytes.clear();
                bytes.reserve_exact(wanted);
                let read = stream.take(wanted as u64).read_to_end(&mut bytes);
                if size.is_blue_first {
                    bytes.chunks_exact_mut(3).for_each(|pixel| pixel.swap(0, 2));
                }
                let picture = match read {
                    Ok(0) => return None,
                    Ok(n) if n == wanted => {
                        Ok(Picture { width: size.width, height: size.height, channels: size.channels, bytes })
                    }
                    Ok(n) => Err(format!("the stream ends after {n} of the frame's {wanted} bytes")),
                    Err(error) => Err(format!("the stream broke off ({error})")),
                };
                self.done = picture.is_err();
                Some(NextFrame { number, picture, encoded: None })
            }
            Kind::Pnm(stream) => {
                let picture = decode::pnm(stream).transpose()?;
                self.done = picture.is_err();
                Some(NextFrame { number, picture, encoded: None })
            }
        }
    }

    /// Takes the bytes of a frame back.
    pub fn reuse(&mut self, picture: Result<Picture, String>) {
        self.scratch = picture.map(|picture| picture.bytes).unwrap_or_default();
    }

    /// The fault that shows only at the end: a video that could not be read.
    pub fn end(&mut self) -> Result<(), Failure> {
        let Some((mut child, path)) = self.video.take() else { return Ok(()) };
        match child.wait() {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(input_fault(
                &path,
                format!("was not read to its end (ffmpeg: {status})"),
                "a whole video",
            )),
            Err(error) => Err(unreadable(&path, &error)),
        }
    }
}

fn unreadable(path: &Path, error: &io::Error) -> Failure {
    let problem = match error.kind() {
        io::ErrorKind::NotFound => "there is no such file or folder".to_owned(),
        _ => format!("cannot be read ({error})"),
    };
    input_fault(path, problem, ALLOWED)
}

fn pictures_of(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let found = pictures_in(folder).map_err(|error| unreadable(folder, &error))?;
    if found.is_empty() {
        return Err(input_fault(folder, "holds no PNG or JPEG frame", ALLOWED));
    }
    Ok(found)
}
