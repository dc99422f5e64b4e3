//! Each promise of the crate, against a file system.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::staging::{PREFIX, Staging, replace, tidy};
use crate::{GrowingFile, OutputRules, StagedFile, StagedFolder, WriteError, list_files, recover};

const ANY: OutputRules<'_> = OutputRules { force: false, inputs: &[] };
const FORCE: OutputRules<'_> = OutputRules { force: true, inputs: &[] };

/// Everything below a folder: files with their bytes, links with their targets, folders.
fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut open) = (BTreeMap::new(), vec![folder.to_owned()]);
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let about = fs::symlink_metadata(&path).unwrap();
            if about.is_dir() {
                open.push(path.clone());
            }
            let bytes = match about.is_symlink() {
                true => fs::read_link(&path).unwrap().into_os_string().into_encoded_bytes(),
                false => fs::read(&path).unwrap_or_default(),
            };
            found.insert(path, bytes);
        }
    }
    found
}

fn result(out: &Path, text: &str, rules: &OutputRules<'_>) -> Result<Option<PathBuf>, WriteError> {
    let staged = StagedFolder::new(out, "build", rules)?;
    staged.write("a.txt", text.as_bytes())?;
    staged.write("b/c.txt", text.as_bytes())?;
    staged.commit()
}

fn file(out: &Path, text: &str, rules: &OutputRules<'_>) -> Result<Option<PathBuf>, WriteError> {
    let mut staged = StagedFile::new(out, "track", rules)?;
    staged.write(text.as_bytes())?;
    staged.commit()
}

#[test]
fn an_unchanged_result_is_replaced_and_nothing_is_left() {
    let place = tempfile::tempdir().unwrap();
    fs::create_dir_all(place.path().join("deep/out")).unwrap();
    fs::write(place.path().join("deep/t.csv"), "").unwrap();
    for text in ["one", "two"] {
        assert_eq!(result(&place.path().join("deep/out"), text, &ANY).unwrap(), None);
        assert_eq!(file(&place.path().join("deep/t.csv"), text, &ANY).unwrap(), None);
        assert_eq!(list_files(&place.path().join("deep/out")).unwrap(), ["a.txt", "b/c.txt"]);
        assert_eq!(fs::read_to_string(place.path().join("deep/t.csv")).unwrap(), text);
        assert_eq!(fs::read_dir(place.path().join("deep")).unwrap().count(), 2);
    }
}

#[cfg(unix)]
#[test]
fn permissions_are_the_users() {
    use std::os::unix::fs::PermissionsExt;
    let place = tempfile::tempdir().unwrap();
    let (out, table) = (place.path().join("out"), place.path().join("t.csv"));
    result(&out, "one", &ANY).unwrap();
    file(&table, "one", &ANY).unwrap();
    let set = |path: &Path, mode: u32| fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    set(&out, 0o750);
    set(&table, 0o640);
    result(&out, "two", &ANY).unwrap();
    file(&table, "two", &ANY).unwrap();
    assert_eq!((mode(&out), mode(&table)), (0o750, 0o640));
    set(&out, 0o550);
    set(&table, 0o440);
    assert!(result(&out, "three", &FORCE).unwrap_err().to_string().contains("read-only"));
    assert!(file(&table, "three", &FORCE).unwrap_err().to_string().contains("read-only"));
}

#[test]
fn what_was_changed_or_added_is_refused_by_name_and_kept_by_force() {
    type Spoil = (&'static str, fn(&Path));
    let spoil: [Spoil; 6] = [
        ("a.txt", |out| fs::write(out.join("a.txt"), "mine").unwrap()),
        ("d.txt", |out| fs::write(out.join("d.txt"), "mine").unwrap()),
        ("b/e/", |out| fs::create_dir(out.join("b/e")).unwrap()),
        ("marker", |out| fs::remove_file(out.join(".domecast")).unwrap()),
        ("marker", |out| {
            // the hash of an edited file, put right: the seal gives it away
            let marker = fs::read_to_string(out.join(".domecast")).unwrap();
            let hash = marker.lines().find(|line| line.ends_with("  a.txt")).unwrap()[..32].to_owned();
            fs::write(out.join(".domecast"), marker.replace(&hash, &"0".repeat(32))).unwrap();
        }),
        ("b/c.txt", |out| {
            fs::rename(out.join("b/c.txt"), out.join("../c.txt")).unwrap();
            #[cfg(unix)]
            std::os::unix::fs::symlink("../../c.txt", out.join("b/c.txt")).unwrap();
            #[cfg(not(unix))]
            fs::write(out.join("b/c.txt"), "mine").unwrap();
        }),
    ];
    for (name, spoil) in spoil {
        let place = tempfile::tempdir().unwrap();
        let out = place.path().join("out");
        result(&out, "one", &ANY).unwrap();
        spoil(&out);
        let before = tree(place.path());
        let message = result(&out, "two", &ANY).unwrap_err().to_string();
        assert!(message.contains(name), "{name}: {message}");
        assert_eq!(tree(place.path()), before);
        let earlier = tree(&out);
        let kept = result(&out, "two", &FORCE).unwrap().unwrap();
        assert_eq!(kept.file_name().unwrap(), "out.bak-1");
        let moved =
            tree(&kept).into_iter().map(|(path, bytes)| (out.join(path.strip_prefix(&kept).unwrap()), bytes));
        assert_eq!(moved.collect::<BTreeMap<_, _>>(), earlier, "{name}");
        assert_eq!(fs::read_to_string(out.join("a.txt")).unwrap(), "two");
        assert_eq!(result(&out, "three", &FORCE).unwrap(), None, "an unchanged result needs no copy");
    }
}

#[test]
fn a_result_of_an_older_version_is_known_by_its_sha_256() {
    use sha2::{Digest, Sha256};
    let hex =
        |bytes: &[u8]| Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    for is_edited in [false, true] {
        let place = tempfile::tempdir().unwrap();
        let out = place.path().join("out");
        result(&out, "one", &ANY).unwrap();
        let marker = fs::read_to_string(out.join(".domecast")).unwrap();
        let (head, rows) = marker.split_once('\n').unwrap();
        let mut older = format!("{head}\n");
        for (_, name) in rows.lines().filter_map(|row| row.split_once("  ")) {
            older += &format!("{}  {name}\n", hex(&fs::read(out.join(name)).unwrap()));
        }
        older += &format!("# seal {}\n", hex(older.as_bytes()));
        fs::write(out.join(".domecast"), older).unwrap();
        if is_edited {
            fs::write(out.join("a.txt"), "mine").unwrap();
        }
        assert_eq!(result(&out, "two", &ANY).is_err(), is_edited);
        assert_eq!(fs::read_to_string(out.join("a.txt")).unwrap(), if is_edited { "mine" } else { "two" });
    }
}

#[test]
fn a_result_that_is_changed_while_the_next_is_made_is_kept() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    result(&out, "one", &ANY).unwrap();
    let staged = StagedFolder::new(&out, "build", &ANY).unwrap();
    fs::write(out.join("a.txt"), "mine").unwrap();
    let kept = staged.commit().unwrap().unwrap();
    assert_eq!(fs::read_to_string(kept.join("a.txt")).unwrap(), "mine");
}

#[test]
fn inputs_other_commands_and_other_peoples_files_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let (out, table) = (place.path().join("out"), place.path().join("m.csv"));
    result(&out, "one", &ANY).unwrap();
    fs::write(&table, "measured").unwrap();
    let before = tree(place.path());
    let input = out.join("a.txt");
    let rules = OutputRules { force: true, inputs: &[&input, &table] };
    let refusals = [
        result(&out, "two", &rules),
        file(&table, "two", &rules),
        file(&table, "two", &ANY),
        file(&out, "two", &FORCE),
        result(&table, "two", &FORCE),
        result(&table.join("below"), "two", &FORCE),
        StagedFolder::new(&out, "simulate", &FORCE).and_then(StagedFolder::commit),
        result(Path::new("."), "two", &FORCE),
        result(Path::new(".."), "two", &FORCE),
        result(Path::new("/"), "two", &FORCE),
        result(&place.path().join("none/../out"), "two", &FORCE),
        #[cfg(unix)]
        file(Path::new("/dev/null"), "two", &FORCE),
        #[cfg(target_os = "linux")]
        result(Path::new("/proc"), "two", &FORCE),
    ];
    for refused in refusals {
        let message = refused.unwrap_err().to_string();
        assert!(message.contains("allowed: "), "{message}");
        assert_eq!(tree(place.path()), before, "{message}");
    }
    let (_first, second) =
        (StagedFolder::new(&out, "build", &ANY).unwrap(), StagedFile::new(&input, "track", &FORCE));
    assert!(second.unwrap_err().to_string().contains("two results"));
}

#[cfg(unix)]
#[test]
fn links_lead_no_result_elsewhere() {
    use std::os::unix::fs::symlink;
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    fs::create_dir_all(at("home/real")).unwrap();
    fs::create_dir(at("far")).unwrap();
    fs::write(at("far/x.csv"), "far").unwrap();
    for (target, link) in
        [("real", "home/near"), ("../far", "home/out"), ("../far/x.csv", "home/t.csv"), ("none", "home/lost")]
    {
        symlink(target, at(link)).unwrap();
    }
    let before = tree(place.path());
    for name in ["home/out", "home/out/", "home/out/.", "home/lost"] {
        assert!(
            result(&at(name), "one", &FORCE).unwrap_err().to_string().contains("symbolic link"),
            "{name}"
        );
    }
    assert!(file(&at("home/t.csv"), "one", &FORCE).is_err());
    assert_eq!(tree(place.path()), before);
    // beside its folder, a link is followed; above the result, folders may be links
    result(&at("home/near"), "one", &ANY).unwrap();
    result(&at("home/out/result"), "one", &ANY).unwrap();
    assert!(at("home/near").is_symlink() && at("home/real/a.txt").is_file());
    assert!(at("far/result/a.txt").is_file());
}

/// A staging folder as a stopped run leaves it: what its entries hold, and whether the place does.
fn stopped(place: &Path, entries: &[(&str, &str)], out: Option<&str>) -> Vec<String> {
    let folder = place.join(format!("{PREFIX}abcdefABCDEF"));
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("target"), "domecast makes a result here, which goes to:\nout").unwrap();
    for (entry, text) in entries {
        if *text == "theirs" {
            fs::create_dir(folder.join(entry)).unwrap();
            fs::write(folder.join(entry).join("theirs.txt"), text).unwrap();
        } else {
            result(&place.join("made"), text, &ANY).unwrap();
            fs::rename(place.join("made"), folder.join(entry)).unwrap();
        }
    }
    if let Some(text) = out {
        result(&place.join("out"), text, &FORCE).unwrap();
    }
    recover([place.join("out").into_os_string()])
}

#[test]
fn the_next_run_ends_what_a_stopped_one_began() {
    type Stop<'a> = (&'a [(&'a str, &'a str)], Option<&'a str>, Option<&'a str>, bool);
    let stops: [Stop<'_>; 8] = [
        (&[], Some("old"), Some("old"), false),
        (&[("draft", "new")], Some("old"), Some("old"), false),
        (&[("swap", "new")], Some("old"), Some("old"), false),
        (&[("swap", "old")], Some("new"), Some("new"), false),
        (&[("swap", "theirs")], Some("new"), Some("new"), true),
        (&[("old", "old"), ("swap", "new")], None, Some("old"), false),
        (&[("old", "old")], Some("new"), Some("new"), false),
        (&[("old", "theirs")], Some("new"), Some("new"), true),
    ];
    for (entries, out, expected, keeps) in stops {
        let place = tempfile::tempdir().unwrap();
        let notes = stopped(place.path(), entries, out);
        assert_eq!(notes.len(), 1, "{entries:?}: {notes:?}");
        let text = fs::read_to_string(place.path().join("out/a.txt")).ok();
        assert_eq!(text.as_deref(), expected, "{entries:?}");
        let theirs = fs::read_to_string(place.path().join("out.bak-1/theirs.txt")).ok();
        assert_eq!(theirs.is_some(), keeps, "{entries:?}");
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1 + usize::from(keeps), "{entries:?}");
        assert!(recover([place.path().join("out").into_os_string()]).is_empty());
    }
}

#[test]
fn a_run_that_only_begins_or_ends_is_not_called_stopped() {
    let place = tempfile::tempdir().unwrap();
    // the moments before `target` is there, before it is locked, and after it is gone
    fs::create_dir(place.path().join(".domecast-000000000000")).unwrap();
    fs::create_dir(place.path().join(".domecast-111111111111")).unwrap();
    fs::write(place.path().join(".domecast-111111111111/target"), "").unwrap();
    assert!(recover([place.path().as_os_str().to_owned()]).is_empty());
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);

    // a result is placed although others remove whatever looks abandoned
    let (out, done) = (place.path().join("out"), std::sync::atomic::AtomicBool::new(false));
    let others = std::thread::scope(|scope| {
        let others = scope.spawn(|| {
            let mut notes = Vec::new();
            while !done.load(std::sync::atomic::Ordering::Relaxed) {
                notes.extend(recover([place.path().as_os_str().to_owned()]));
            }
            notes
        });
        let made: Result<(), WriteError> = (0..200).try_for_each(|_| result(&out, "new", &ANY).map(drop));
        done.store(true, std::sync::atomic::Ordering::Relaxed);
        made.unwrap();
        others.join().unwrap()
    });
    assert_eq!(others, [""; 0]);
}

#[test]
fn what_only_looks_like_a_stopped_run_is_left_alone() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    fs::create_dir_all(at(".domecast-notes/draft")).unwrap();
    fs::create_dir_all(at(".domecast-000000000000/draft")).unwrap();
    fs::write(at(".domecast-000000000000/target"), "thesis").unwrap();
    fs::create_dir(at(".domecast-111111111111")).unwrap();
    fs::write(at(".domecast-111111111111/thesis.tex"), "three years").unwrap();
    let escape = "domecast makes a result here, which goes to:\n../../elsewhere";
    fs::create_dir(at(".domecast-222222222222")).unwrap();
    fs::write(at(".domecast-222222222222/target"), escape).unwrap();
    // of a run that lives
    let _live = Staging::new(&fs::canonicalize(place.path()).unwrap(), Path::new("out")).unwrap();
    let before = tree(place.path());
    assert!(recover([place.path().as_os_str().to_owned()]).is_empty());
    assert_eq!(tree(place.path()), before);
}

#[test]
fn two_steps_do_where_there_is_no_exchange() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    for force in [false, true] {
        let _ = fs::remove_dir_all(at("out"));
        result(&at("out"), "old", &ANY).unwrap();
        if force {
            fs::write(at("out/a.txt"), "mine").unwrap();
        }
        fs::create_dir(at("hidden")).unwrap();
        result(&at("hidden/new"), "new", &ANY).unwrap();
        replace(&at("hidden/new"), &at("out"), &at("hidden/old")).unwrap();
        let tidied = tidy(place.path(), &at("hidden"), Path::new("out")).unwrap();
        assert_eq!(tidied.kept.is_some(), force);
        assert_eq!(fs::read_to_string(at("out/a.txt")).unwrap(), "new");
    }
    assert_eq!(fs::read_to_string(at("out.bak-1/a.txt")).unwrap(), "mine");
    // a step that fails leaves the place as it was
    assert!(replace(&at("none"), &at("out"), &at("aside")).is_err());
    assert_eq!(fs::read_to_string(at("out/a.txt")).unwrap(), "new");
}

#[test]
fn a_growing_file_is_there_at_once_and_a_result_once_it_has_ended() {
    use std::io::Write;
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("a.mcap");
    let (mut growing, kept) = GrowingFile::new(&path, "track", &ANY).unwrap();
    assert_eq!(kept, None);
    growing.write_all(b"first").unwrap();
    // as it is after a kill
    assert_eq!(fs::read(&path).unwrap(), b"first");
    assert!(matches!(GrowingFile::new(&path, "track", &ANY), Err(WriteError::NotOurs { .. })));
    growing.write_all(b" second").unwrap();
    growing.end().unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"first second");
    // a whole one is a result like others, where the file system can mark it
    if file(&path, "third", &ANY).is_err() {
        return;
    }
    fs::write(&path, "someone's").unwrap();
    assert!(GrowingFile::new(&path, "track", &ANY).is_err());
    let (growing, kept) = GrowingFile::new(&path, "track", &FORCE).unwrap();
    assert_eq!(fs::read_to_string(kept.unwrap()).unwrap(), "someone's");
    drop(growing);
    assert_eq!(fs::read(&path).unwrap(), b"");
}

#[test]
fn an_index_is_replaced_whole_and_leaves_nothing_beside_it() {
    let place = tempfile::tempdir().expect("a folder");
    let path = place.path().join("new/index.json");
    for text in ["{}", "{\"a\": 1}"] {
        super::replace_file(&path, text.as_bytes()).expect("written");
        assert_eq!(std::fs::read_to_string(&path).expect("there"), text);
    }
    assert_eq!(std::fs::read_dir(place.path().join("new")).expect("a folder").count(), 1);
    let refused = super::replace_file(&place.path().join("new"), b"x").expect_err("a folder stands there");
    assert!(refused.to_string().contains("new"), "{refused}");
}
