//! The swapchain in a real window, on a display without a screen.

use std::{
    process::{Child, Command, Stdio},
    time::Duration,
};

use winit::{
    application::ApplicationHandler,
    dpi::PhysicalSize,
    event::WindowEvent,
    event_loop::{ActiveEventLoop, EventLoop},
    platform::{pump_events::EventLoopExtPumpEvents, x11::EventLoopBuilderExtX11},
    raw_window_handle::{HasDisplayHandle, HasWindowHandle},
    window::{Window, WindowAttributes, WindowId},
};

use super::*;

/// Set in the child process that has a display of its own.
const CHILD: &str = "REEF_SWAPCHAIN_CHILD";

/// An X server without a screen, killed when dropped.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn start() -> Option<Display> {
        use std::io::{BufRead, BufReader};
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "800x600x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let mut number = String::new();
        BufReader::new(server.stdout.take()?).read_line(&mut number).ok()?;
        Some(Display { server, name: format!(":{}", number.trim()) })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

#[test]
fn a_window_that_changes_its_size_200_times_is_drawn_without_a_message() {
    if std::env::var_os(CHILD).is_some() {
        return;
    }
    let required = std::env::var("REEF_REQUIRE").as_deref() == Ok("all");
    let Some(display) = Display::start() else {
        assert!(!required, "Xvfb is needed");
        eprintln!("skipped: there is no Xvfb");
        return;
    };
    let program = std::env::current_exe().expect("this test");
    let ran = Command::new(program)
        .args(["--exact", "swapchain_tests::inside_the_display", "--nocapture"])
        .env("DISPLAY", &display.name)
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .env(CHILD, "1")
        .output()
        .expect("a child process");
    let said = String::from_utf8_lossy(&ran.stdout) + String::from_utf8_lossy(&ran.stderr);
    if said.contains("skipped:") && !required {
        eprintln!("{said}");
        return;
    }
    assert!(ran.status.success() && said.contains("drawn and closed"), "{said}");
}

/// The other half of the test above, in a process of its own with the display in its environment.
#[test]
fn inside_the_display() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let mut events = EventLoop::builder().with_x11().with_any_thread(true).build().expect("events");
    let mut hands = Hands::default();
    events.pump_app_events(Some(Duration::ZERO), &mut hands);
    let window = hands.window.take().expect("a window");
    let display = window.display_handle().expect("a display").as_raw();
    let handle = window.window_handle().expect("a handle").as_raw();
    let options = GpuOptions { validation: Validation::CoreSync, ..GpuOptions::default() };
    let (gpu, surface) = match Gpu::open_for_window(&options, display, handle) {
        Ok(opened) => opened,
        Err(error) => {
            println!("skipped: {error}");
            return;
        }
    };
    let canary = gpu.canary();
    let mut frames = Frames::new(&gpu, 2).expect("frames");
    let size = |window: &Window| {
        let size = window.inner_size();
        (size.width, size.height)
    };
    let mut swapchain = Swapchain::new(&gpu, surface, size(&window), 2).expect("a swapchain");
    let mut shown = 0;
    let mut sizes = std::collections::BTreeSet::new();
    for round in 0..200u32 {
        let wanted = match round % 10 {
            0 => (1, 1),
            n => (40 + 61 * n, 30 + 37 * ((round / 10 + n) % 11)),
        };
        let _ = window.request_inner_size(PhysicalSize::new(wanted.0, wanted.1));
        // Drawn before and after the window system has heard of it: both must be survived.
        for _ in 0..2 {
            shown += u32::from(draw(&mut swapchain, &mut frames, None));
            events.pump_app_events(Some(Duration::from_millis(1)), &mut hands);
            swapchain.resized(size(&window));
            sizes.insert(swapchain.size());
        }
        if round % 50 == 7 {
            // A frame that fails after its image was taken: the next one is drawn all the same.
            if swapchain.prepare().expect("prepared") {
                let frame = frames.begin().expect("a frame");
                let _ = swapchain.acquire(&frame).expect("no error");
            }
        }
        if round % 10 == 5 {
            swapchain.resized((0, 0));
            assert!(!draw(&mut swapchain, &mut frames, None), "a window without area shows nothing");
            swapchain.resized(size(&window));
            swapchain.set_vsync(round % 20 == 5);
        }
    }
    assert!(shown > 300, "only {shown} of 400 frames were shown");

    assert!(sizes.len() > 60 && sizes.contains(&(1, 1)), "the window hardly changed: {sizes:?}");

    // What is presented is what was drawn.
    let mut taken = None;
    for _ in 0..10 {
        if draw(&mut swapchain, &mut frames, Some(&mut taken)) {
            break;
        }
        events.pump_app_events(Some(Duration::from_millis(5)), &mut hands);
        swapchain.resized(size(&window));
    }
    let picture = taken.expect("shown").finish(&mut frames).expect("a picture");
    let expected = if swapchain.encodes_srgb() { [255, 0, 170, 255] } else { [255, 0, 102, 255] };
    assert_eq!(picture.pixel(picture.width / 2, picture.height / 2), Some(expected));
    drop((swapchain, frames));
    assert_eq!(gpu.close(), Vec::<String>::new());
    assert_eq!(canary.take(), []);
    println!(
        "{shown} frames in {} sizes drawn and closed; {} messages let pass",
        sizes.len(),
        canary.suppressed()
    );
}

/// Clears the window to one colour; whether it was shown.
fn draw(swapchain: &mut Swapchain, frames: &mut Frames, taken: Option<&mut Option<Readback>>) -> bool {
    if !swapchain.prepare().expect("prepared") {
        return false;
    }
    let mut frame = frames.begin().expect("a frame");
    let Some(acquired) = swapchain.acquire(&frame).expect("no error") else { return false };
    let picture = swapchain.image(&acquired).expect("an image");
    frame.pass("clear").color(picture, Load::Clear([1.0, 0.0, 0.4, 1.0])).run(|_| Ok(())).expect("a pass");
    if let Some(taken) = taken {
        *taken = Some(frame.read_back(picture).expect("a copy"));
    }
    frame.finish_for_present(picture).expect("finished");
    frame.submit(swapchain.signals(&acquired)).expect("submitted");
    swapchain.present(acquired).expect("presented");
    true
}

#[derive(Default)]
struct Hands {
    window: Option<Window>,
}

impl ApplicationHandler for Hands {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let attributes = WindowAttributes::default().with_inner_size(PhysicalSize::new(320, 240));
        self.window = Some(events.create_window(attributes).expect("a window"));
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, _: WindowEvent) {}
}
