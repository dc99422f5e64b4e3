//! A page of this machine that shows the readings live: the frame with what is tracked in it and the forces on the skin, curves of
//! the wrench, the skin's depth as colours.
//!
//! The server answers on 127.0.0.1 alone, to requests that name that host, and to no page of another site. The page gets
//! server-sent events: one way is all it needs, browsers connect again by themselves, and unlike a WebSocket it stands
//! behind the browser's own rule that other sites read nothing. Each browser has a thread that sends the newest picture when it
//! has sent the last one, so a slow one sees fewer and holds nobody up.
//!
//! ```
//! use domecast_live::page::{LivePage, ShownSensor};
//! # fn page_of(optics: domecast_optics::SensorOptics) -> std::io::Result<()> {
//!
//! let page = LivePage::start(0, ShownSensor { optics, forces: None })?;
//! assert!(page.url().starts_with("http://127.0.0.1:"));
//! # Ok(())
//! # }
//! ```

mod latest;
mod painter;
mod request;
mod server;
mod shared;

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::thread;

use crate::reading::LiveReading;
use domecast_runtime::track::Tracked;
use painter::Painter;
pub use painter::ShownSensor;
use server::serve;
use shared::{MAX_SAMPLES, Shared};

/// The page and its server.
pub struct LivePage {
    shared: Arc<Shared>,
    address: SocketAddr,
}

impl LivePage {
    /// Starts the server at a port of 127.0.0.1; 0: any that is free.
    ///
    /// # Errors
    /// The port is taken, or the system has no threads.
    pub fn start(port: u16, sensor: ShownSensor) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared::default());
        let of_painter = Arc::clone(&shared);
        let mut painter = Painter::new(sensor);
        thread::Builder::new().name("painter".into()).spawn(move || painter.paint(&of_painter))?;
        let of_server = Arc::clone(&shared);
        thread::Builder::new().name("page".into()).spawn(move || serve(&listener, &of_server))?;
        Ok(Self { shared, address })
    }

    /// Where a browser finds it.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Whether anybody looks.
    pub fn is_watched(&self) -> bool {
        self.shared.browsers.load(Ordering::Relaxed) > 0
    }

    /// Adds the wrench of a frame to the curves.
    pub fn add_sample(&self, tracked: &Tracked) {
        let mut samples = self.shared.samples.lock().unwrap_or_else(PoisonError::into_inner);
        if samples.len() >= MAX_SAMPLES {
            samples.pop_front();
        }
        let time_s = tracked.time_s.unwrap_or(0.0);
        samples.push_back((time_s, tracked.wrench.map(|wrench| wrench.to_array())));
    }

    /// Shows a reading; never waits for a browser.
    pub fn show(&self, reading: LiveReading) {
        self.shared.reading.set(reading);
    }
}

impl Drop for LivePage {
    fn drop(&mut self) {
        self.shared.is_stopped.store(true, Ordering::Relaxed);
        self.shared.reading.wake();
        self.shared.event.wake();
        // wakes the server, which waits for a browser
        let _ = TcpStream::connect(self.address);
    }
}
