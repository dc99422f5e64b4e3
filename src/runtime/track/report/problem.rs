//! What is wrong with a frame.

/// What is wrong with a frame, the gravest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Problem {
    /// The file or the stream gave no frame.
    Unreadable,
    /// The frame does not have the camera's size.
    WrongSize,
    /// Too little light to separate marks from the ground.
    Dark,
    /// Most of the frame is at the largest value.
    Saturated,
    /// The picture is turned against the constants' camera: every dot would carry another one's number.
    Turned,
    /// The picture is mirrored, and perhaps turned.
    Mirrored,
    /// Nothing that could be this sensor's marks.
    NoMarks,
    /// Too few white markers are seen for a pose.
    MarkersMissing,
    /// White markers are seen, but no pose within reach puts them there.
    MarkersDoNotFit,
    /// The dots are not where pose and constants put them: the constants are those of another camera or sensor.
    ForeignConstants,
    /// The pose is one that the springs cannot have (bound, torn off their magnets): damage, or constants of another
    /// sensor. There is no wrench where their law ends.
    BeyondSprings,
    /// Two poses explain the white markers.
    AmbiguousPose,
    /// The gap that tells how the picture lies is not seen, or more than one: broken dots, dirt, or dots of a picture
    /// that is turned or shifted.
    KeyUnsure,
    /// A load beyond its deviations, frame after frame, while the skin shows no touch: camera or mount have moved since the
    /// calibration, or something holds the platform beside the dome.
    Drift,
    /// Edges of marks are much wider than a lens in focus has them: defocus, or motion while the shutter was open.
    Blurred,
    /// Every other row is of another moment.
    Interlaced,
    /// Rows above and below one are of two moments.
    Torn,
    /// The frame is the last one again: bit by bit, or but for less than the camera's noise, or everything that moved stands
    /// still in it.
    Frozen,
    /// Frames are missing before this one.
    Gap,
    /// Much brighter or darker than the last frame.
    ExposureJump,
    /// The pose rests on three white markers, or on ones that do not look like markers: nothing checks it.
    ThreeMarkers,
    /// A twentieth or more of the dots that should be seen are not.
    DotsLost,
    /// The pose rests on two white markers and, for what they leave open, on the dots: a touch that moves many of them is in
    /// its deviations. Graver than [`Problem::ThreeMarkers`]; its bit in records is the newest.
    TwoMarkers,
}

impl Problem {
    /// All of them, the gravest first.
    pub const ALL: [Self; 23] = [
        Self::Unreadable,
        Self::WrongSize,
        Self::Dark,
        Self::Saturated,
        Self::Turned,
        Self::Mirrored,
        Self::NoMarks,
        Self::MarkersMissing,
        Self::MarkersDoNotFit,
        Self::ForeignConstants,
        Self::BeyondSprings,
        Self::AmbiguousPose,
        Self::KeyUnsure,
        Self::Drift,
        Self::Blurred,
        Self::Interlaced,
        Self::Torn,
        Self::Frozen,
        Self::Gap,
        Self::ExposureJump,
        Self::TwoMarkers,
        Self::ThreeMarkers,
        Self::DotsLost,
    ];

    /// The name that files carry.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Unreadable => "unreadable",
            Self::WrongSize => "wrong_size",
            Self::Dark => "dark",
            Self::Saturated => "saturated",
            Self::Turned => "turned",
            Self::Mirrored => "mirrored",
            Self::NoMarks => "no_marks",
            Self::MarkersMissing => "markers_missing",
            Self::MarkersDoNotFit => "markers_do_not_fit",
            Self::ForeignConstants => "foreign_constants",
            Self::BeyondSprings => "beyond_springs",
            Self::AmbiguousPose => "ambiguous_pose",
            Self::KeyUnsure => "key_unsure",
            Self::Drift => "drift",
            Self::Blurred => "blurred",
            Self::Interlaced => "interlaced",
            Self::Torn => "torn",
            Self::Frozen => "frozen",
            Self::Gap => "gap",
            Self::ExposureJump => "exposure_jump",
            Self::TwoMarkers => "two_markers",
            Self::ThreeMarkers => "three_markers",
            Self::DotsLost => "dots_lost",
        }
    }
}

/// A set of problems.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Problems(u32);

impl Problems {
    pub(in crate::track) fn add(&mut self, problem: Problem) {
        self.0 |= 1 << problem as u32;
    }

    /// Whether one is among them.
    pub fn has(self, problem: Problem) -> bool {
        self.0 & (1 << problem as u32) != 0
    }

    /// Whether there are none.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// All of them, the gravest first.
    pub fn iter(self) -> impl Iterator<Item = Problem> {
        Problem::ALL.into_iter().filter(move |problem| self.has(*problem))
    }

    /// `ok`, or the name of the gravest.
    pub fn status(self) -> &'static str {
        self.iter().next().map_or("ok", Problem::as_str)
    }
}
