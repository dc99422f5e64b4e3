//! What a comparison consists of.

use serde::Serialize;
use serde_json::Value;

/// Everything that differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Names of the two designs.
    pub names: [String; 2],
    /// Fields of the design that differ, in the file's order; reasons (`why`) are no difference.
    pub fields: Vec<Difference<Value>>,
    /// The dots.
    pub dots: DotDifference,
    /// Parts whose volume or size differ, or that only one side has.
    pub parts: Vec<PartDifference>,
    /// Lines of the load envelope that differ.
    pub loads: Vec<Difference<String>>,
    /// Standard deviations of the wrench at rest, Fx .. Mz: N, N*mm.
    pub wrench_sd: Vec<Difference<f64>>,
    /// Largest difference of an element of the stiffness at rest, as a share of its diagonal.
    pub stiffness_share: Option<f64>,
}

/// A thing with a name and a value on either side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference<T> {
    /// What it is.
    pub name: String,
    /// On the first side, if it is there.
    pub a: Option<T>,
    /// On the second side, if it is there.
    pub b: Option<T>,
}

/// How the dots differ. Dots are paired by their places in the image: each with the nearest of the other side, if
/// that is mutual and nearer than half a pitch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DotDifference {
    /// How many dots each side has.
    pub counts: [usize; 2],
    /// How many are paired.
    pub paired: usize,
    /// Mean and largest distance of a pair in the raw image, px.
    pub image_px: Option<[f64; 2]>,
    /// The same on the dome, mm.
    pub surface_mm: Option<[f64; 2]>,
    /// The same on the plate, mm.
    pub plate_mm: Option<[f64; 2]>,
    /// The same for the diameter on the dome, mm.
    pub diameter_mm: Option<[f64; 2]>,
}

/// How a part differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartDifference {
    /// Its name.
    pub name: String,
    /// Volumes, mm^3.
    pub volume_mm3: [Option<f64>; 2],
    /// Sizes along x, y, z, mm.
    pub size_mm: [Option<[f64; 3]>; 2],
}
