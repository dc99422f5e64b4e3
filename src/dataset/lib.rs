//! Sets of simulated touches for learning.
//!
//! A [`Dataset`] is read from a spec ([`spec::DatasetSpec`]). Its videos come in pairs that share everything (object, press, sensor,
//! light, times, forces) but the object's stiffness and the noise, so that nothing but what stiffness does tells the two apart.
//! A [`Maker`] makes shards: a pair depends on the spec and its own number alone, so a shard has the same bytes wherever it is made.
//!
//! ```text
//! spec -> check -> draw -> sensor, scene -> video -> readings, tracked -> record -> make -> index
//! ```

mod check;
mod draw;
mod frame_reader;
mod index;
mod make;
mod read;
mod readings;
mod record;
mod scene;
mod sensor;
mod sensor_draw;
pub mod spec;
mod splits;
mod tar;
mod tracked;
mod video;

pub use check::Dataset;
pub use draw::PairDraw;
pub use index::{FORMAT, INDEX_NAME};
pub use make::{Maker, Shard};
pub use read::{ReadingRow, StoredSet, StoredVideo};
pub use record::Made;
pub use splits::split_of_slice;
