//! The edge of a lamp's shadow on the ground: two levels with a ramp between them.

/// An edge between two levels.
#[derive(Debug, Clone, Copy)]
pub(super) struct LightEdge {
    /// Unit vector towards the further side, place of the line along it, half of the edge's width, px.
    pub way: [f32; 2],
    pub at: f32,
    pub half: f32,
    /// What the further side has more.
    pub step: f32,
}

impl LightEdge {
    /// What it adds to the ground at a place.
    pub fn level(&self, x: f32, y: f32) -> f32 {
        self.step * ramp(x * self.way[0] + y * self.way[1], self.at, self.half)
    }
}

/// From 0 on the nearer side to 1 on the further one.
pub(super) fn ramp(along: f32, at: f32, half: f32) -> f32 {
    (0.5 + 0.5 * (along - at) / half).clamp(0.0, 1.0)
}
