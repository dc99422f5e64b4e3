//! Where the program keeps tables from run to run.

use std::fs::File;
use std::io::Read;
use std::path::PathBuf;

use domecast_files::Cache;

/// The cache of this program: `DOMECAST_CACHE`, else `domecast` in the user's folder for such things. `None` where there is no such
/// folder, or the program cannot read itself: its bytes show whether tables are its own.
pub fn of_program() -> Option<Cache> {
    let folder = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    // a relative XDG folder is to be ignored (XDG Base Directory Specification)
    let user = || folder("XDG_CACHE_HOME").filter(|path| path.is_absolute());
    let home = || folder("HOME").map(|home| home.join(".cache"));
    let place = folder("DOMECAST_CACHE").or_else(|| Some(user().or_else(home)?.join("domecast")))?;
    Cache::new(&place, program()?.chain(processor().as_bytes())).ok()
}

/// The running program, also where its file was replaced since it began.
fn program() -> Option<File> {
    File::open("/proc/self/exe").or_else(|_| File::open(std::env::current_exe()?)).ok()
}

/// What of the processor chooses between ways to compute: last digits differ with it.
fn processor() -> String {
    #[cfg(target_arch = "x86_64")]
    let extensions = [
        std::arch::is_x86_feature_detected!("avx2"),
        std::arch::is_x86_feature_detected!("fma"),
        std::arch::is_x86_feature_detected!("avx512f"),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let extensions = ();
    format!("{} {extensions:?}", std::env::consts::ARCH)
}
