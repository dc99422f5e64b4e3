//! Writing in a thread of its own.

use std::io::{self, Write};
use std::mem;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

/// Pieces that wait at most: with those of a recording some 64 MB, or a second of raw frames. Whoever writes more waits.
const MAX_WAITING: usize = 64;

/// What is written behind one's back.
enum Behind<W> {
    Writing(SyncSender<Vec<u8>>, JoinHandle<io::Result<W>>),
    /// The thread has ended, and its fault was reported.
    Failed,
}

/// Hands what is written to a thread, in order: a disk that stands still for a moment holds no reading up. A fault is reported
/// by the next write, or at the end.
pub struct BehindWriter<W>(Behind<W>);

fn ended() -> io::Error {
    io::Error::other("the thread that writes has ended")
}

impl<W: Write + Send + 'static> BehindWriter<W> {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system has none.
    pub fn start(mut to: W) -> io::Result<Self> {
        let (pieces, of_thread) = sync_channel::<Vec<u8>>(MAX_WAITING);
        let write = move || {
            for piece in of_thread {
                to.write_all(&piece)?;
            }
            to.flush().map(|()| to)
        };
        Ok(Self(Behind::Writing(pieces, thread::Builder::new().name("recording".into()).spawn(write)?)))
    }

    /// Waits until all is written, and returns where to.
    ///
    /// # Errors
    /// What the system says.
    pub fn into_inner(mut self) -> io::Result<W> {
        self.join()
    }
}

impl<W> BehindWriter<W> {
    fn join(&mut self) -> io::Result<W> {
        match mem::replace(&mut self.0, Behind::Failed) {
            Behind::Writing(pieces, thread) => {
                drop(pieces);
                thread.join().unwrap_or_else(|_| Err(ended()))
            }
            Behind::Failed => Err(ended()),
        }
    }
}

impl<W> Write for BehindWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Behind::Writing(pieces, _) = &self.0
            && pieces.send(bytes.to_vec()).is_ok()
        {
            return Ok(bytes.len());
        }
        Err(self.join().err().unwrap_or_else(ended))
    }

    /// What was handed over is written in its turn.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<W> Drop for BehindWriter<W> {
    fn drop(&mut self) {
        // what was handed over is written before the program ends
        let _ = self.join();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Takes so many bytes, slowly.
    struct Disk {
        bytes: Vec<u8>,
        room: usize,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            thread::sleep(Duration::from_millis(1));
            if self.bytes.len() + bytes.len() > self.room {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.bytes.extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn all_is_written_in_its_order_and_a_full_disk_is_told() {
        let mut writer = BehindWriter::start(Disk { bytes: Vec::new(), room: 1000 }).unwrap();
        for byte in 0..100 {
            writer.write_all(&[byte; 3]).unwrap();
        }
        let written: Vec<u8> = (0..100).flat_map(|byte| [byte; 3]).collect();
        assert_eq!(writer.into_inner().unwrap().bytes, written);
        let mut writer = BehindWriter::start(Disk { bytes: Vec::new(), room: 10 }).unwrap();
        let fault = (0..1000).find_map(|_| writer.write_all(&[0; 3]).err()).unwrap();
        assert_eq!(fault.kind(), io::ErrorKind::StorageFull);
        assert!(writer.into_inner().is_err());
        let mut writer = BehindWriter::start(Disk { bytes: Vec::new(), room: 0 }).unwrap();
        writer.write_all(&[0; 3]).unwrap();
        assert_eq!(writer.into_inner().map(|_| ()).unwrap_err().kind(), io::ErrorKind::StorageFull);
    }
}
