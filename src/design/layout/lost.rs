//! Why a dot of the pattern is not laid out.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let layout = Design::load(THUMB24.as_ref())?.layout()?;
//! for lost in &layout.lost {
//!     println!("dot {}: {}", lost.id, lost.reason);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::fmt;

use glam::DVec2;

use crate::transfer::TransferLimit;
use domecast_optics::RayLimit;

/// A dot of the pattern that is left out.
#[derive(Debug, Clone, PartialEq)]
pub struct LostDot {
    /// Its number; the numbers of lost dots follow those of the dots that are laid out.
    pub id: u32,
    /// Its centre in the frame in which the pattern is even, px.
    pub even_px: DVec2,
    /// Its centre in the raw image, px, where it has one.
    pub image_px: Option<DVec2>,
    /// Why.
    pub reason: Reason,
}

/// Why a dot is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reason {
    /// Lens, layers or dome give no ray for it.
    Unseen(RayLimit),
    /// Part of it would lie outside the image.
    OutsideImage,
    /// Part of it would lie outside the runtime's mask.
    OutsideMask,
    /// A white marker is in its line of sight.
    HiddenByMarker {
        /// Number of the white marker.
        marker: u32,
    },
    /// The edge of the upper platform's window is in its line of sight.
    HiddenByPlatform,
    /// A keep-out zone of the design.
    KeepOut(Zone),
    /// Smaller on the plate than can be etched.
    TooSmall {
        /// Its least width on the plate, mm.
        width_mm: f64,
        /// What can be printed, mm.
        min_mm: f64,
    },
    /// Closer to a dot nearer to the centre than the pad keeps apart.
    TooClose {
        /// Width of the gap on the plate, mm.
        gap_mm: f64,
        /// What can be printed, mm.
        min_mm: f64,
    },
    /// Further around the dome than the pad can wrap, from every print pass.
    BeyondWrap {
        /// Largest angle between its normals and the stroke, rad.
        wrap_rad: f64,
        /// The limit, rad.
        limit_rad: f64,
    },
    /// The pad's map does not reach it.
    BeyondTransfer(TransferLimit),
    /// Its outline cannot be drawn to the tolerance.
    NotSmooth {
        /// What was reached, mm.
        error_mm: f64,
    },
}

/// A zone without dots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Zone {
    /// Around the pole.
    Pole,
    /// Along the rim.
    Rim,
    /// Around a white marker's image.
    WhiteMarker(u32),
    /// A disc of the design, by its index.
    ImageDisc(u32),
}

/// Which of the design's rules a reason falls under.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// `pattern.unseen`.
    Unseen,
    /// `pattern.unprintable`.
    Unprintable,
    /// A keep-out zone: always left out.
    KeepOut,
}

impl Reason {
    /// What would keep the dot, in words.
    pub fn cure(&self) -> &'static str {
        match self {
            Self::TooSmall { .. } => "larger dots, or a smaller pattern where only outer ones are too small",
            Self::TooClose { .. } => "a larger pitch or smaller dots",
            Self::HiddenByMarker { .. } => "white markers further out, or a smaller pattern",
            Self::BeyondWrap { .. } => "a smaller pattern, or print.hits \"split\"",
            Self::NotSmooth { .. } => "a larger print.outline_tolerance_mm, or a smaller pattern",
            Self::Unseen(_)
            | Self::OutsideImage
            | Self::OutsideMask
            | Self::HiddenByPlatform
            | Self::KeepOut(_)
            | Self::BeyondTransfer(_) => "a smaller pattern",
        }
    }

    /// The reason's name in files.
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::Unseen(limit) => limit.as_str(),
            Self::OutsideImage => "outside_image",
            Self::OutsideMask => "outside_mask",
            Self::HiddenByMarker { .. } => "hidden_by_white_marker",
            Self::HiddenByPlatform => "hidden_by_platform",
            Self::KeepOut(Zone::Pole) => "keep_out_pole",
            Self::KeepOut(Zone::Rim) => "keep_out_rim",
            Self::KeepOut(Zone::WhiteMarker(_)) => "keep_out_white_marker",
            Self::KeepOut(Zone::ImageDisc(_)) => "keep_out_image_disc",
            Self::TooSmall { .. } => "too_small_to_print",
            Self::TooClose { .. } => "too_close_to_print",
            Self::BeyondWrap { .. } => "beyond_wrap_limit",
            Self::BeyondTransfer(limit) => limit.as_str(),
            Self::NotSmooth { .. } => "outline_not_smooth",
        }
    }

    /// The rule that decides what happens.
    pub fn rule(&self) -> Rule {
        match self {
            Self::Unseen(_)
            | Self::OutsideImage
            | Self::OutsideMask
            | Self::HiddenByMarker { .. }
            | Self::HiddenByPlatform => Rule::Unseen,
            Self::KeepOut(_) => Rule::KeepOut,
            Self::TooSmall { .. }
            | Self::TooClose { .. }
            | Self::BeyondWrap { .. }
            | Self::BeyondTransfer(_)
            | Self::NotSmooth { .. } => Rule::Unprintable,
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unseen(limit) => write!(f, "the lens cannot see it ({limit})"),
            Self::OutsideImage => write!(f, "part of it lies outside the image"),
            Self::OutsideMask => write!(f, "part of it lies outside the runtime's mask"),
            Self::HiddenByMarker { marker } => write!(f, "white marker {marker} hides it"),
            Self::HiddenByPlatform => write!(f, "the edge of the upper platform's window hides it"),
            Self::KeepOut(zone) => match zone {
                Zone::Pole => write!(f, "it reaches into the keep-out zone at the pole"),
                Zone::Rim => write!(f, "it reaches into the keep-out zone at the rim"),
                Zone::WhiteMarker(id) => write!(f, "it reaches into the keep-out zone of white marker {id}"),
                Zone::ImageDisc(index) => write!(f, "it reaches into keep-out disc {index}"),
            },
            Self::TooSmall { width_mm, min_mm } => {
                write!(f, "it is {width_mm:.3} mm wide on the plate, {min_mm} mm can be printed")
            }
            Self::TooClose { gap_mm, min_mm } => {
                write!(f, "its gap to a neighbour is {gap_mm:.3} mm on the plate, {min_mm} mm can be printed")
            }
            Self::BeyondWrap { wrap_rad, limit_rad } => write!(
                f,
                "it lies {:.2} deg around the pad's stroke, the limit is {:.2} deg",
                wrap_rad.to_degrees(),
                limit_rad.to_degrees()
            ),
            Self::BeyondTransfer(limit) => write!(f, "the pad's map does not reach it: {limit}"),
            Self::NotSmooth { error_mm } => write!(f, "its outline is off by {error_mm:.2e} mm"),
        }
    }
}
