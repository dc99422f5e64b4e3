//! A source by the name that a command line has for it.

use std::io::{self, BufReader};
use std::path::Path;

use super::LiveSource;
use super::camera::{CameraRequest, open_camera};
use super::player::Player;
use super::player_options::PlayerOptions;
use super::stream::PictureStream;

/// Opens `-` (PPM pictures on standard input), `player:FOLDER?rate=60`, or a camera's path.
///
/// # Errors
/// What is wrong with the name, the folder or the camera, in words.
pub fn open_device(name: &str, request: CameraRequest) -> Result<Box<dyn LiveSource>, String> {
    if name == "-" {
        return Ok(Box::new(PictureStream::new(BufReader::new(io::stdin()))));
    }
    if let Some(spec) = name.strip_prefix("player:") {
        let (folder, options) = PlayerOptions::parse(spec)?;
        return Ok(Box::new(Player::open(&folder, options)?));
    }
    open_camera(Path::new(name), request)
}
