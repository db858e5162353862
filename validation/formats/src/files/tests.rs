use super::*;
use rustix::fs::{CWD, FileType, Mode, mknodat};
use std::os::unix::fs::symlink;
use std::path::PathBuf;

#[test]
fn writes_and_replaces() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    write_bytes(&path, Existing::Replace, b"one").unwrap();
    write_bytes(&path, Existing::Replace, b"two").unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), b"two");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn an_unwritable_folder_is_named_with_the_cause() {
    let folder = tempfile::tempdir().unwrap();
    let blocker = folder.path().join("blocker");
    std::fs::write(&blocker, b"").unwrap();
    for (path, cause) in [
        (blocker.join("a.txt"), io::ErrorKind::NotADirectory),
        (folder.path().join("none/a.txt"), io::ErrorKind::NotFound),
    ] {
        let error = write_bytes(&path, Existing::Replace, b"x").unwrap_err();
        let text = error.to_string();
        assert!(text.contains(path.to_str().unwrap()), "{text}");
        let found = error.cause;
        assert_eq!(found.kind(), cause);
        assert!(text.contains(&found.to_string()), "{text}");
        assert!(!text.contains(".psidpd-"), "{text}");
    }
}

/// The target of a link is replaced, or created if it does not exist, and the link stays.
#[test]
fn links_are_followed() {
    let folder = tempfile::tempdir().unwrap();
    let [first, second, file] = ["first", "second", "inner/file"].map(|name| folder.path().join(name));
    std::fs::create_dir(folder.path().join("inner")).unwrap();
    symlink("second", &first).unwrap();
    symlink("inner/file", &second).unwrap();
    for bytes in [b"one", b"two"] {
        write_bytes(&first, Existing::Replace, bytes).unwrap();
        assert_eq!(std::fs::read(&file).unwrap(), bytes);
        assert!(first.is_symlink() && second.is_symlink() && !file.is_symlink());
    }
    symlink("round", folder.path().join("round")).unwrap();
    assert!(write_bytes(&folder.path().join("round"), Existing::Replace, b"x").is_err());
}

/// A pipe gets the bytes and stays a pipe.
#[test]
fn what_is_no_file_is_written_to() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe");
    mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
    let link = folder.path().join("link");
    symlink("pipe", &link).unwrap();
    for path in [&pipe, &link] {
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::read(pipe).unwrap()
        });
        write_bytes(path, Existing::Replace, b"bytes").unwrap();
        assert_eq!(reader.join().unwrap(), b"bytes");
        assert!(!std::fs::metadata(&pipe).unwrap().is_file());
    }
    write_bytes(Path::new("/dev/null"), Existing::Keep, b"bytes").unwrap();
    assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
}

#[test]
fn a_folder_is_not_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    assert!(write_bytes(&inner, Existing::Replace, b"x").is_err());
    assert!(write_bytes(Path::new("/"), Existing::Replace, b"x").is_err());
    assert!(write_bytes(Path::new(""), Existing::Replace, b"x").is_err());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// A file of the user's stays without leave; what psidpd made, and what is empty, may go.
#[test]
fn files_of_others_stay() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f");
    let page = format!("<!DOCTYPE html>\n<html><head>{PAGE}</head></html>");
    let json = json_text(&[1, 2]).unwrap();
    assert_eq!(serde_json::from_str::<Vec<u32>>(&json).unwrap(), [1, 2]);
    for (text, goes) in [
        ("mine", false),
        ("{\"mine\": 1}\n", false),
        ("<!DOCTYPE html>\n<html></html>", false),
        ("", true),
        (page.as_str(), true),
        (json.as_str(), true),
    ] {
        std::fs::write(&path, text).unwrap();
        assert_eq!(may_replace(&path, Existing::Keep).is_ok(), goes, "{text}");
        assert_eq!(write_bytes(&path, Existing::Keep, b"new").is_ok(), goes, "{text}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), if goes { "new" } else { text });
        write_bytes(&path, Existing::Replace, b"new").unwrap();
    }
    let _input = protect([&path]);
    assert!(write_bytes(&path, Existing::Replace, b"x").is_err());
    assert!(replace_inside(&path, b"x", false).is_err() && remove_if_there(&path).is_err());
    drop(_input);
    replace_inside(&path, b"x", false).unwrap();
    remove_if_there(&path).unwrap();
}

/// In the folder of a run a link is not followed, and a pipe is not opened.
#[test]
fn nothing_leads_out_of_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let (outside, inner) = (folder.path().join("outside"), folder.path().join("inner"));
    std::fs::create_dir(&inner).unwrap();
    let path = inner.join("f");
    let places: [&dyn Fn(); 3] =
        [&|| symlink("../outside", &path).unwrap(), &|| symlink("/dev/zero", &path).unwrap(), &|| {
            mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap()
        }];
    for place in places {
        std::fs::write(&outside, "mine").unwrap();
        place();
        assert!(read_inside(&path).unwrap_err().to_string().contains("not a regular file"));
        assert!(open_inside_to_write(&path).is_err() && create_inside(&path).is_err());
        replace_inside(&path, b"new", false).unwrap();
        assert_eq!(read_inside(&path).unwrap(), b"new");
        assert_eq!(std::fs::read(&outside).unwrap(), b"mine");
        remove_if_there(&path).unwrap();
    }
    symlink("..", inner.join("up")).unwrap();
    assert!(folder_inside(&inner.join("up")).is_err() && names_inside(&inner.join("up")).is_empty());
}

/// What a killed process left is removed by the next that writes there; what another is writing stays, and what has another name.
#[test]
fn leftovers_go() {
    let folder = tempfile::tempdir().unwrap();
    let [left, busy, notes] =
        [".psidpd-AbC123", ".psidpd-abcdef", ".psidpd-notes.txt"].map(|n| folder.path().join(n));
    for path in [&left, &busy, &notes] {
        std::fs::write(path, "x").unwrap();
    }
    let lock = std::fs::File::open(&busy).unwrap();
    lock.lock().unwrap();
    write_bytes(&folder.path().join("f"), Existing::Keep, b"x").unwrap();
    assert!(!left.exists() && busy.exists() && notes.exists());
}

/// A draft without an end leaves nothing, and its name may be taken meanwhile.
#[test]
fn a_draft_has_no_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f");
    let mut draft = Draft::new(&path, false).unwrap();
    io::Write::write_all(&mut draft, &[b'x'; 100_000]).unwrap();
    assert!(!path.exists());
    std::fs::write(&path, "mine").unwrap();
    assert_eq!(draft.finish(true).unwrap_err().kind(), ErrorKind::AlreadyExists);
    assert_eq!(std::fs::read(&path).unwrap(), b"mine");
    drop(Draft::new(&path, true).unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// A mark is that of one folder and one user: an empty one, a copy, and another user's are none.
#[test]
fn a_mark_from_elsewhere_gives_no_leave() {
    let folder = tempfile::tempdir().unwrap();
    let [work, mine] = ["work", "mine"].map(|name| folder.path().join(name));
    work_folder(&work).unwrap();
    std::fs::create_dir_all(mine.join("inner")).unwrap();
    let refuses = |what: &str| {
        for file in ["f", "inner/f"] {
            std::fs::write(mine.join(file), "mine").unwrap();
            assert!(write_bytes(&mine.join(file), Existing::Keep, b"x").is_err(), "{what}");
        }
        assert!(work_folder(&mine).is_err() && remove_work(&mine).is_err(), "{what}");
    };
    for text in [String::new(), std::fs::read_to_string(work.join(".psidpd")).unwrap()] {
        std::fs::write(mine.join(".psidpd"), &text).unwrap();
        refuses(&text);
    }
    // Ways through a marked folder that lead out of it.
    std::fs::remove_file(mine.join(".psidpd")).unwrap();
    symlink("../mine", work.join("link")).unwrap();
    for way in ["../mine/f", "link/f", "link/inner/../f"] {
        assert!(write_bytes(&work.join(way), Existing::Keep, b"x").is_err(), "{way}");
        assert_eq!(std::fs::read(mine.join("f")).unwrap(), b"mine", "{way}");
    }
    // Only the administrator can give a file to another user.
    if std::os::unix::fs::chown(work.join(".psidpd"), Some(12_345), None).is_ok() {
        std::fs::write(work.join("f"), "mine").unwrap();
        assert!(write_bytes(&work.join("f"), Existing::Keep, b"x").is_err());
    }
}

#[test]
fn a_folder_of_work_is_new_or_was_made_here() {
    let folder = tempfile::tempdir().unwrap();
    let work = folder.path().join("a/work");
    for _ in 0..2 {
        work_folder(&work).unwrap();
        write_bytes(&work.join("f"), Existing::Keep, b"x").unwrap();
        work_folder(&work.join("inner")).unwrap();
        write_bytes(&work.join("inner/f"), Existing::Keep, b"x").unwrap();
    }
    std::fs::write(folder.path().join("mine"), "").unwrap();
    assert!(work_folder(folder.path()).is_err());
    assert!(work_folder(&PathBuf::from("/")).is_err());
}
