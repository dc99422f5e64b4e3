//! Room for pressures over a height map, kept between frames.

/// Room for a frame's pressures, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct PressureRoom {
    pub borne: Vec<Borne>,
    /// By node: what the skin's own shape says of the pressure about it.
    pub touched: Vec<f64>,
    /// By cell: pressure and its deviation.
    pub values: [Vec<f32>; 2],
}

/// A cell of the height map, with the nodes that bear on it and their shares.
#[derive(Debug, Clone, Copy)]
pub(super) struct Borne {
    pub cell: usize,
    pub area_mm2: f64,
    pub nodes: [(usize, f64); 4],
    /// What the skin's own shape says of the pressure, of no unit.
    pub own: f64,
}
