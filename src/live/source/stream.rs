//! Frames of another program, through a pipe.

use std::io::Read;
use std::sync::Arc;
use std::time::Instant;

use super::{ArrivedFrame, FrameData, LiveSource, SourceInfo, SourceLost};
use crate::decode::pnm;

/// PGM or PPM pictures one after the other, each complete when its last byte is read.
pub struct PictureStream<R> {
    stream: R,
    began: Instant,
    number: u64,
    info: SourceInfo,
}

impl<R: Read + Send> PictureStream<R> {
    /// Of any reader; one with a buffer of its own reads the pictures' heads fast.
    pub fn new(stream: R) -> Self {
        let info = SourceInfo { name: "-".into(), format: "stream", ..SourceInfo::default() };
        Self { stream, began: Instant::now(), number: 0, info }
    }
}

impl<R: Read + Send> LiveSource for PictureStream<R> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<ArrivedFrame>, SourceLost> {
        let Some(picture) = pnm(&mut self.stream).map_err(SourceLost)? else { return Ok(None) };
        let (number, complete) = (self.number, Instant::now());
        self.number += 1;
        Ok(Some(ArrivedFrame {
            number,
            time_s: complete.duration_since(self.began).as_secs_f64(),
            complete,
            data: FrameData::Pixels(Arc::new(picture)),
            file: None,
        }))
    }

    fn comes_back(&self) -> bool {
        false
    }

    fn reopen(&mut self) -> Result<(), SourceLost> {
        Err(SourceLost("a stream that broke off does not come back".into()))
    }
}
