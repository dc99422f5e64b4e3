//! What is known of a mark.

/// What is known of a mark in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MarkState {
    /// Seen and measured.
    Ok,
    /// Never seen since the start, where it should be.
    #[default]
    Missing,
    /// Seen before, not now.
    Lost,
    /// Run together with another one.
    Merged,
    /// Seen, but it is not clear which mark it is.
    IdentityUnsure,
    /// Seen with something dark on it or beside it.
    Dirty,
    /// Seen wider or longer than it should be, or twice.
    Smeared,
    /// Seen with a reflection on it or beside it.
    Glare,
    /// A part of it is covered.
    PartlyHidden,
    /// Outside of the mask or of the camera's view at this pose.
    Hidden,
}

impl MarkState {
    /// The name that files carry.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Missing => "missing",
            Self::Lost => "lost",
            Self::Merged => "merged",
            Self::IdentityUnsure => "identity_unsure",
            Self::Dirty => "dirty",
            Self::Smeared => "smeared",
            Self::Glare => "glare",
            Self::PartlyHidden => "partly_hidden",
            Self::Hidden => "hidden",
        }
    }
}
