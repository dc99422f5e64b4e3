//! A page for each subject, short, with the formulas and their sources.
//!
//! | when | pages |
//! |---|---|
//! | choose and design | [`design`], [`dots`], [`simulating`], [`accuracy`] |
//! | make | [`printing`], [`casting`] |
//! | calibrate and run | [`force`], [`tracking`], [`shape`], [`live`], [`python`], [`formats`] |
//! | learn | [`hardness`] |
//! | change domecast | [`architecture`] |

#[doc = include_str!("guide/design.md")]
pub mod design {}
#[doc = include_str!("guide/dots.md")]
pub mod dots {}
#[doc = include_str!("guide/printing.md")]
pub mod printing {}
#[doc = include_str!("guide/casting.md")]
pub mod casting {}
#[doc = include_str!("guide/force.md")]
pub mod force {}
#[doc = include_str!("guide/simulating.md")]
pub mod simulating {}
#[doc = include_str!("guide/tracking.md")]
pub mod tracking {}
#[doc = include_str!("guide/shape.md")]
pub mod shape {}
#[doc = include_str!("guide/live.md")]
pub mod live {}
#[doc = include_str!("guide/accuracy.md")]
pub mod accuracy {}
#[doc = include_str!("guide/python.md")]
pub mod python {}
#[doc = include_str!("guide/formats.md")]
pub mod formats {}
#[doc = include_str!("guide/hardness.md")]
pub mod hardness {}
#[doc = include_str!("guide/architecture.md")]
pub mod architecture {}
