//! The canary: every message of the validation layers is kept and counted, and one is enough to fail a check.

use std::{
    ffi::{CStr, c_void},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU32, Ordering},
    },
};

use ash::vk;

/// How many messages are kept word by word; all are counted.
const KEPT: usize = 64;

/// When a [`Suppression`] holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// Always.
    Always,
    /// Only between the moment in which a window's size changed and the first frame at the new size.
    WhileResizing,
}

/// A message that is known to be wrong or harmless: which one, from which version of the layer, when, and
/// why.
#[derive(Clone, Copy, Debug)]
pub struct Suppression {
    /// The message's name.
    pub vuid: &'static str,
    /// First version of the layer that says it wrongly.
    pub since: u32,
    /// Last version of the layer that was seen to.
    pub until: u32,
    /// When it is let pass.
    pub scope: Scope,
    /// Why it may be.
    pub reason: &'static str,
}

/// The one table of suppressions.
pub const SUPPRESSIONS: &[Suppression] = &[
    Suppression {
        vuid: "VUID-VkSwapchainCreateInfoKHR-imageExtent-01274",
        since: vk::make_api_version(0, 1, 3, 0),
        until: vk::make_api_version(0, 1, 4, 999),
        scope: Scope::WhileResizing,
        reason: "on X11 the window can change between asking for the surface's extent and making the swapchain, \
                 which no application can prevent: KhronosGroup/Vulkan-Docs issue 1144",
    },
    Suppression {
        vuid: "UNASSIGNED-BestPractices-vkCreateInstance-specialuse-extension-debugging",
        since: vk::make_api_version(0, 1, 3, 0),
        until: vk::make_api_version(0, 1, 3, 250),
        scope: Scope::Always,
        reason: "VK_EXT_debug_utils is how this very message arrives; without validation it only gives names",
    },
    Suppression {
        vuid: "UNASSIGNED-BestPractices-ImageBarrierAccessLayout",
        since: vk::make_api_version(0, 1, 3, 0),
        until: vk::make_api_version(0, 1, 3, 250),
        scope: Scope::Always,
        reason: "the layer expects SHADER_READ for a sampled image and does not know that SHADER_SAMPLED_READ is the \
                 part of it that is meant",
    },
];

/// One message.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Message {
    /// `error` or `warning`.
    pub severity: &'static str,
    /// The layer's name for it, `REEF-…` where Reef itself noticed.
    pub id: String,
    /// What it says.
    pub text: String,
}

impl std::fmt::Display for Message {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}: {}", self.severity, self.id, self.text)
    }
}

#[derive(Debug, Default)]
struct Heard {
    messages: Vec<Message>,
    count: u64,
    suppressed: u64,
}

/// Collects what the layers say. One lives as long as its instance, and longer for who asks afterwards.
#[derive(Debug, Default)]
pub struct Canary {
    heard: Mutex<Heard>,
    resizing: AtomicBool,
    layer_version: AtomicU32,
}

impl Canary {
    /// How many messages came that no suppression covers.
    pub fn count(&self) -> u64 {
        self.lock().count
    }

    /// How many messages were let pass.
    pub fn suppressed(&self) -> u64 {
        self.lock().suppressed
    }

    /// The first messages, word by word.
    pub fn messages(&self) -> Vec<Message> {
        self.lock().messages.clone()
    }

    /// Takes and forgets what was heard, so that the next check starts clean.
    pub fn take(&self) -> Vec<Message> {
        std::mem::take(&mut *self.lock()).messages
    }

    /// Tells the canary that the window's size is changing, or has settled.
    pub fn set_resizing(&self, resizing: bool) {
        self.resizing.store(resizing, Ordering::Relaxed);
    }

    /// Which version of the layer speaks; 0: none.
    pub(crate) fn set_layer_version(&self, version: u32) {
        self.layer_version.store(version, Ordering::Relaxed);
    }

    /// Adds something that Reef noticed by itself.
    pub(crate) fn report(&self, id: &str, text: String) {
        self.hear(Message { severity: "error", id: id.to_owned(), text });
    }

    fn hear(&self, message: Message) {
        let suppressed = is_suppressed(
            &message.id,
            self.layer_version.load(Ordering::Relaxed),
            self.resizing.load(Ordering::Relaxed),
        );
        if suppressed {
            self.lock().suppressed += 1;
            tracing::debug!(target: "reef::gpu::validation", "let pass: {message}");
            return;
        }
        tracing::error!(target: "reef::gpu::validation", "{message}");
        let mut heard = self.lock();
        heard.count += 1;
        if heard.messages.len() < KEPT {
            heard.messages.push(message);
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Heard> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn is_suppressed(id: &str, layer: u32, resizing: bool) -> bool {
    SUPPRESSIONS.iter().any(|s| {
        s.vuid == id
            && (s.since..=s.until).contains(&layer)
            && match s.scope {
                Scope::Always => true,
                Scope::WhileResizing => resizing,
            }
    })
}

/// What the messenger is made from; `canary` has to outlive the instance.
pub(crate) fn messenger_info(canary: &Canary) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(
            vk::DebugUtilsMessageSeverityFlagsEXT::ERROR | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
        )
        .message_type(
            vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE
                | vk::DebugUtilsMessageTypeFlagsEXT::GENERAL,
        )
        .pfn_user_callback(Some(on_message))
        .user_data(std::ptr::from_ref(canary).cast_mut().cast())
}

/// The loader's and the layers' way in.
unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the loader passes the pointer that `messenger_info` stored, whose canary outlives the instance,
    // and data that is valid for the length of the call.
    let (canary, data) = unsafe { (user.cast::<Canary>().as_ref(), data.as_ref()) };
    let (Some(canary), Some(data)) = (canary, data) else { return vk::FALSE };
    // SAFETY: the specification has these strings null or null-terminated.
    let (id, text) = unsafe { (text(data.p_message_id_name), text(data.p_message)) };
    let severity =
        if severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR) { "error" } else { "warning" };
    let of_layers =
        vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE;
    if types.intersects(of_layers) {
        canary.hear(Message { severity, id, text });
    } else {
        // The loader speaks of drivers that it could not load: news for the log, no fault of ours.
        tracing::debug!(target: "reef::gpu::loader", "{severity} {id}: {text}");
    }
    vk::FALSE
}

/// # Safety
/// `pointer` is null or points to a null-terminated string.
unsafe fn text(pointer: *const std::ffi::c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: as the caller promises.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYER: u32 = vk::make_api_version(0, 1, 3, 239);
    const RESIZE: &str = "VUID-VkSwapchainCreateInfoKHR-imageExtent-01274";

    fn message(id: &str) -> Message {
        Message { severity: "error", id: id.to_owned(), text: "text".to_owned() }
    }

    #[test]
    fn every_message_is_counted_and_the_first_ones_are_kept() {
        let canary = Canary::default();
        for _ in 0..KEPT + 5 {
            canary.hear(message("VUID-x"));
        }
        assert_eq!(canary.count(), KEPT as u64 + 5);
        assert_eq!(canary.take().len(), KEPT);
        assert_eq!(canary.count(), 0);
    }

    #[test]
    fn a_resize_message_passes_only_during_a_resize_and_only_from_a_known_layer() {
        let canary = Canary::default();
        canary.set_layer_version(LAYER);
        canary.hear(message(RESIZE));
        assert_eq!((canary.count(), canary.suppressed()), (1, 0));
        canary.set_resizing(true);
        canary.hear(message(RESIZE));
        canary.hear(message("VUID-VkSwapchainCreateInfoKHR-imageExtent-01689"));
        assert_eq!((canary.count(), canary.suppressed()), (2, 1));
        canary.set_layer_version(vk::make_api_version(0, 2, 0, 0));
        canary.hear(message(RESIZE));
        assert_eq!((canary.count(), canary.suppressed()), (3, 1));
    }

    #[test]
    fn every_suppression_gives_a_reason_and_a_range_of_versions() {
        for s in SUPPRESSIONS {
            assert!(s.reason.len() > 20 && s.since > 0 && s.since <= s.until, "{}", s.vuid);
        }
    }
}
