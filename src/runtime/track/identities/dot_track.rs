//! What is remembered of a dot from frame to frame.

use glam::DVec2;

use crate::track::marks::{DarkSpot, MarkState, SpotOutline};

/// What is remembered of a dot.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::track) struct DotTrack {
    /// Where the pose puts its centroid on the undeformed dome, px.
    pub expected_px: Option<DVec2>,
    /// Centroid less the image of its centre, px.
    pub offset_px: DVec2,
    /// Outline of its image at this pose.
    pub outline: SpotOutline,
    /// By how much it was beside that when it was last seen, px.
    pub displaced_px: Option<DVec2>,
    /// Where it was in the last frame, if it was seen in it.
    pub last_px: Option<DVec2>,
    /// Motion of its centroid since the last frame, px.
    pub motion_px: Option<DVec2>,
    /// Where it was looked for.
    pub start_px: Option<DVec2>,
    pub state: MarkState,
    pub ever_seen: bool,
    /// Whether the last search left open which dot it is.
    pub is_unsure: bool,
    pub spot: Option<DarkSpot>,
    /// Why the spot does not look like a dot, if it does not.
    pub fault: Option<MarkState>,
}

impl DotTrack {
    /// Where it is now.
    pub fn now_px(&self) -> Option<DVec2> {
        self.spot.map(|s| s.at_px)
    }

    /// By how much it is beside where the undeformed dome would show it, px; where it is found.
    pub fn off_px(&self) -> Option<DVec2> {
        Some(self.now_px()? - self.expected_px?)
    }

    /// Image of its centre: the centroid less what a disc on the dome has its centroid off, px.
    pub fn center_px(&self) -> Option<DVec2> {
        Some(self.spot?.at_px - self.offset_px)
    }

    /// Whether it should be seen.
    pub fn is_wanted(&self) -> bool {
        self.state != MarkState::Hidden
    }

    /// Not seen in this frame, for this reason.
    pub fn lose(&mut self, state: MarkState) {
        self.spot = None;
        self.state = state;
    }

    /// Its state where nothing is found: seen before or not.
    pub fn absent(&self) -> MarkState {
        if self.ever_seen { MarkState::Lost } else { MarkState::Missing }
    }

    /// Measured in this frame.
    pub fn find(&mut self, spot: DarkSpot) {
        self.spot = Some(spot);
        self.state = MarkState::Ok;
    }

    /// Remembers what was found for the next frame; a displacement keeps its last value until there is a new one.
    pub fn remember(&mut self) {
        let now = self.now_px();
        if let Some(now) = now {
            self.ever_seen = true;
            if let Some(expected) = self.expected_px {
                self.displaced_px = Some(now - expected);
            }
        }
        self.motion_px = now.zip(self.last_px).map(|(now, last)| now - last);
        self.last_px = now;
    }

    /// The last frame does not count: the next one has nothing to be followed from.
    pub fn forget_last(&mut self) {
        self.last_px = None;
    }
}
