//! Which display the window opens on, decided before the window system is asked: it may be asked only once.

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

/// The window system that a display belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum System {
    Wayland,
    X11,
}

/// What the environment says of displays.
pub(super) struct Environment<'a> {
    /// A variable's value.
    pub(super) variable: &'a dyn Fn(&str) -> Option<OsString>,
    /// Does somebody listen at this socket?
    pub(super) answers: &'a dyn Fn(&Path) -> bool,
}

impl Environment<'_> {
    fn set(&self, name: &str) -> Option<OsString> {
        (self.variable)(name).filter(|value| !value.is_empty())
    }

    /// The system to connect to; None: no display is named. A Wayland display where nobody answers gives way
    /// to one of X.
    pub(super) fn system(&self) -> Option<System> {
        let x = self.set("DISPLAY").map(|_| System::X11);
        let Some(name) = self.set("WAYLAND_DISPLAY") else {
            return self.set("WAYLAND_SOCKET").map(|_| System::Wayland).or(x);
        };
        // A socket that was handed over is no matter of names.
        if x.is_none() || self.set("WAYLAND_SOCKET").is_some() {
            return Some(System::Wayland);
        }
        let socket = match self.set("XDG_RUNTIME_DIR") {
            _ if Path::new(&name).is_absolute() => Some(PathBuf::from(name)),
            folder => folder.map(|folder| Path::new(&folder).join(name)),
        };
        if socket.is_some_and(|socket| (self.answers)(&socket)) { Some(System::Wayland) } else { x }
    }

    /// What is wrong with the variable that scales windows under X: the window system panics at it.
    pub(super) fn wrong_scale(&self) -> Option<String> {
        let value = self.set(SCALE)?;
        // It reads nothing that is not Unicode.
        let text = value.to_str()?;
        let right = text.eq_ignore_ascii_case("randr")
            || text.parse::<f64>().is_ok_and(|scale| scale.is_sign_positive() && scale.is_normal());
        (!right).then(|| format!("{SCALE}={text}: this is no scale"))
    }
}

/// Factor of sizes under X.
const SCALE: &str = "WINIT_X11_SCALE_FACTOR";
/// What it may be.
pub(super) const SCALES: &str = "a number above 0, as in WINIT_X11_SCALE_FACTOR=1.5, or `randr`";

#[cfg(test)]
mod tests {
    use super::*;

    fn system(variables: &[(&str, &str)], sockets: &[&str]) -> Option<System> {
        let variable =
            |name: &str| variables.iter().find(|(known, _)| *known == name).map(|(_, value)| value.into());
        let answers = |path: &Path| sockets.iter().any(|socket| Path::new(socket) == path);
        Environment { variable: &variable, answers: &answers }.system()
    }

    #[test]
    fn a_wayland_display_where_nobody_answers_gives_way_to_x() {
        let [wayland, x, run] =
            [("WAYLAND_DISPLAY", "wayland-7"), ("DISPLAY", ":1"), ("XDG_RUNTIME_DIR", "/run/me")];
        let there = ["/run/me/wayland-7"];
        assert_eq!(system(&[wayland, x, run], &there), Some(System::Wayland));
        assert_eq!(system(&[wayland, x, run], &[]), Some(System::X11));
        assert_eq!(system(&[wayland, x], &there), Some(System::X11), "nobody says where its socket is");
        assert_eq!(system(&[("WAYLAND_DISPLAY", "/w"), x, run], &["/w"]), Some(System::Wayland));
        assert_eq!(system(&[wayland, run], &[]), Some(System::Wayland), "there is nothing else to try");
        assert_eq!(system(&[x], &[]), Some(System::X11));
        assert_eq!(system(&[("WAYLAND_DISPLAY", ""), x], &[]), Some(System::X11));
        assert_eq!(system(&[("WAYLAND_SOCKET", "5"), x], &[]), Some(System::Wayland));
        assert_eq!(system(&[], &[]), None);
    }

    #[test]
    fn scales_that_would_panic_are_refused() {
        let wrong = |value: &str| {
            let variable = |name: &str| (name == SCALE).then(|| value.into());
            Environment { variable: &variable, answers: &|_| false }.wrong_scale()
        };
        for value in ["", "1", "1.5", "randr", "RandR"] {
            assert_eq!(wrong(value), None, "{value}");
        }
        for value in ["abc", "0", "-1", "nan", "inf", "1e-320", "1,5"] {
            assert_eq!(wrong(value), Some(format!("WINIT_X11_SCALE_FACTOR={value}: this is no scale")));
        }
    }
}
