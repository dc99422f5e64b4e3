//! The page that people look at before they send a film to a print shop: `report/index.html`.
//!
//! One self-contained file: pictures, style, script and the assembly stand in it, so that it opens from a disk
//! without a network. It sees only what the build has made; it computes nothing that goes into another file.
//!
//! ```
//! use domecast_fab::report::{stamp, watched};
//!
//! let page = watched("<html><body><p>a page</p></body></html>");
//! assert!(page.contains("fresh-stamp.js"));
//! assert_eq!(stamp("12ab"), "window.domecastBuild(\"12ab\");\n");
//! ```

mod constants;
mod electrical;
mod forces;
mod light;
mod making;
mod measured;
mod overlay;
mod page;
mod parts;
mod pattern;
pub mod section;
mod subject;
mod verdict;
mod watch;

pub(crate) use light::markers;
pub use making::{MakingStep, making_steps};
pub use measured::MEASURED;
pub use page::page;
pub use subject::ReportSubject;
pub use watch::{stamp, watched};
