//! Other instances in the place of running ones: of a newer build, of an older one after a fault, or once
//! more of the same.
//!
//! They are made beside the sea, which goes on meanwhile: create, load the state, look at it, one trial step;
//! then the steps that the sea has made since, each with just what that step let the module read. When they
//! have reached the present, they take their places between two steps. Whatever fails on the way changes
//! nothing.

use std::{
    collections::{BTreeMap, VecDeque},
    path::PathBuf,
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use reef_abi as abi;
use reef_plugin::{Health, Instance, Plugin, PluginError, StepStatus};

use crate::step::{
    recent::{Fixed, Follower, Frozen, Moment, Snap},
    world::World,
};

/// Why instances are made beside the sea.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// A newer build.
    Reload,
    /// An older build, because the newest one is at fault.
    Takeover,
    /// Another chance for the one that failed.
    Retry,
}

/// One module's new instance, as it is ordered.
#[derive(Debug)]
struct Order {
    module: usize,
    name: String,
    plugin: Plugin,
    config: String,
    /// None: it begins anew.
    snap: Option<Snap>,
    /// What the scene sets from the start; for one that begins anew.
    params: Vec<abi::Event>,
    /// Steps from this one on are left out: the module stood still in them.
    until: u64,
}

/// One module's new instance on its way to the present.
#[derive(Debug)]
struct Candidate {
    module: usize,
    name: String,
    instance: Instance,
    snap: Option<Snap>,
    /// Its last step.
    at: u64,
    until: u64,
    /// Parameters that changed in steps that were left out.
    missed: Vec<abi::Event>,
}

#[derive(Debug)]
enum Phase {
    /// Not there yet.
    Working,
    /// As far as all that was fed.
    Ready(Vec<Candidate>),
    /// It cannot be; what was made is dropped already.
    Failed(String),
    /// Taken or no longer wanted.
    Over,
}

/// Instances that are being made beside the sea. Worked on by [`Job::work`] on another thread than the sea's.
#[derive(Debug)]
pub struct Job {
    /// Why.
    pub purpose: Purpose,
    began: Instant,
    fixed: Arc<Fixed>,
    /// The sea's last step when the job was given.
    now: Arc<Moment>,
    dt: f64,
    /// The host's folder of assets.
    assets: PathBuf,
    orders: Mutex<Vec<Order>>,
    phase: Mutex<Phase>,
    queue: Mutex<VecDeque<Arc<Moment>>>,
    bell: Condvar,
}

/// Steps to make up for.
type Moments = BTreeMap<u64, Arc<Moment>>;

/// What came of asking for a swap.
#[derive(Debug)]
pub enum Swap {
    /// Not ready: ask again after the next step.
    NotYet,
    /// Done. The former instances, to be dropped where waiting does no harm.
    Done(Vec<Instance>),
    /// It will not be; the sea is as it was.
    Failed(String),
    /// The sea was set back, or is another one: order again.
    Lost,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Job {
    /// When it was ordered.
    pub fn began(&self) -> Instant {
        self.began
    }

    /// Nobody waits for it any more.
    pub fn cancel(&self) {
        // A former candidate's destructor may run in here; `work` drops the rest.
        *lock(&self.phase) = Phase::Over;
        let _queue = lock(&self.queue);
        self.bell.notify_all();
    }

    /// Makes the instances and keeps them at the present until they are taken or no longer wanted. `tell` is
    /// called whenever they have reached it, and when it failed.
    pub fn work(&self, tell: impl Fn()) {
        let made = self.make();
        let mut candidates = match made {
            Ok(candidates) => candidates,
            Err(problem) => return self.fail(problem, &tell),
        };
        loop {
            loop {
                // The queue stays locked while the phase says that it is empty.
                let mut queue = lock(&self.queue);
                let Some(moment) = queue.pop_front() else {
                    let mut phase = lock(&self.phase);
                    if matches!(*phase, Phase::Over) {
                        return;
                    }
                    *phase = Phase::Ready(candidates);
                    break;
                };
                drop(queue);
                if matches!(*lock(&self.phase), Phase::Over) {
                    return;
                }
                for candidate in &mut candidates {
                    if let Err(problem) = candidate.follow(&moment, &self.fixed) {
                        return self.fail(problem, &tell);
                    }
                }
            }
            tell();
            let mut queue = lock(&self.queue);
            loop {
                let mut phase = lock(&self.phase);
                match &mut *phase {
                    Phase::Ready(waiting) if !queue.is_empty() => {
                        candidates = std::mem::take(waiting);
                        *phase = Phase::Working;
                        break;
                    }
                    Phase::Ready(_) => {}
                    _ => return,
                }
                drop(phase);
                queue = self.bell.wait(queue).unwrap_or_else(PoisonError::into_inner);
            }
        }
    }

    fn fail(&self, problem: String, tell: &impl Fn()) {
        let mut phase = lock(&self.phase);
        if !matches!(*phase, Phase::Over) {
            *phase = Phase::Failed(problem);
        }
        drop(phase);
        tell();
    }

    fn make(&self) -> Result<Vec<Candidate>, String> {
        let orders = std::mem::take(&mut *lock(&self.orders));
        orders.into_iter().map(|order| self.candidate(order)).collect()
    }

    /// A new instance with the state in it, after one trial step of it.
    fn candidate(&self, order: Order) -> Result<Candidate, String> {
        let told = |what: &str, error: &PluginError| format!("{}: {what}: {}", order.name, reason(error));
        let Order { module, ref plugin, ref config, ref snap, ref params, until, .. } = order;
        let assets = &self.assets;
        let mut instance =
            plugin.create_among(config, assets).map_err(|error| told("create refused", &error))?;
        let step = snap.as_ref().map_or(self.now.step, |snap| snap.step);
        for trial in [true, false] {
            match snap {
                Some(snap) => {
                    instance
                        .load(&snap.state)
                        .map_err(|error| told("the state cannot be carried", &error))?;
                }
                None if !trial => {
                    instance.reset().map_err(|error| told("reset failed after the trial step", &error))?;
                }
                None => {}
            }
            let (mut input, _) = self.now.input(module, &self.fixed);
            (input.step, input.time, input.dt) = (step, step as f64 * self.dt, 0.0);
            judge(&order.name, "the look at its state", &mut instance, &input, params)?;
            if trial {
                let step = step + 1;
                (input.step, input.time, input.dt) = (step, step as f64 * self.dt, self.dt);
                input.flags |= abi::STEP_TRIAL;
                judge(&order.name, "the trial step", &mut instance, &input, &[])?;
            }
        }
        let at = if snap.is_some() { step } else { u64::MAX };
        Ok(Candidate { module, name: order.name, instance, snap: order.snap, at, until, missed: Vec::new() })
    }

    /// Waits until the instances have reached this step, or cannot, but not for ever: for a sea that outruns
    /// them.
    pub fn wait(&self, step: u64, most: Duration) {
        let end = Instant::now() + most;
        while Instant::now() < end {
            match &*lock(&self.phase) {
                Phase::Working => {}
                Phase::Ready(candidates) if !candidates.iter().all(|candidate| candidate.is_at(step)) => {}
                _ => return,
            }
            std::thread::sleep(Duration::from_micros(200));
        }
    }
}

impl Follower for Job {
    fn feed(&self, moment: &Arc<Moment>) -> bool {
        if matches!(*lock(&self.phase), Phase::Failed(_) | Phase::Over) {
            return false;
        }
        lock(&self.queue).push_back(moment.clone());
        self.bell.notify_all();
        true
    }

    fn lose(&self) {
        self.cancel();
    }
}

/// One step on the side.
fn judge(
    name: &str,
    what: &str,
    instance: &mut Instance,
    input: &reef_plugin::StepInput<'_>,
    events: &[abi::Event],
) -> Result<(), String> {
    let report = instance.step(input, events);
    match report.status {
        // A step that is refused leaves the state untouched: that is sound.
        StepStatus::Ok | StepStatus::Sleep | StepStatus::Discarded => Ok(()),
        StepStatus::Failed | StepStatus::Standing => {
            let why = report.message.unwrap_or_else(|| "it gave no reason".to_owned());
            Err(format!("{name}: {what} failed: {why}"))
        }
    }
}

/// An error without the plugin's id, which stands before it already.
fn reason(error: &PluginError) -> String {
    match error {
        PluginError::Call { status, message, .. } => format!("{status}: {message}"),
        PluginError::State { message, .. } | PluginError::Config { message, path: None, .. } => {
            message.clone()
        }
        PluginError::Config { message, path: Some(path), .. } => format!("{path}: {message}"),
        PluginError::Refused { reason, .. } => reason.to_string(),
        PluginError::Fault { .. } => error.to_string(),
    }
}

impl Candidate {
    /// Makes a step that the sea has made.
    fn follow(&mut self, moment: &Moment, fixed: &Fixed) -> Result<(), String> {
        let (input, events) = moment.input(self.module, fixed);
        if moment.step >= self.until {
            self.missed.extend(events.iter().filter(|event| event.kind == abi::EVENT_PARAM));
        } else if moment.step > self.at {
            let what = format!("making up for step {}", moment.step);
            judge(&self.name, &what, &mut self.instance, &input, events)?;
            self.at = moment.step;
        }
        Ok(())
    }

    /// Is it where the sea is?
    fn is_at(&self, step: u64) -> bool {
        self.at >= step || self.until <= step
    }
}

impl World {
    /// Orders instances of a newer build for all modules that use one of these plugins; None: no module does.
    ///
    /// `Err`: a running module does not give its state.
    pub fn order_reload(&mut self, plugins: &[Plugin]) -> Result<Option<Arc<Job>>, PluginError> {
        let mut orders = Vec::new();
        let mut moments = Moments::new();
        for module in 0..self.members.len() {
            let id = &self.members[module].instance.info().id;
            let Some(plugin) = plugins.iter().find(|plugin| plugin.info().id == *id) else { continue };
            let plugin = plugin.clone();
            let order = match self.frozen(module) {
                Some(frozen) => {
                    // The build that mends what failed: it makes up for all that is remembered.
                    let frozen = frozen.clone();
                    moments.extend(frozen.moments.iter().map(|moment| (moment.step, moment.clone())));
                    let until = if frozen.stale { frozen.failed_in } else { u64::MAX };
                    self.order(module, plugin, frozen.snap, until)
                }
                None => {
                    let state = self.members[module].instance.save()?;
                    let snap = Snap { step: self.clock.step, state: Arc::new(state) };
                    self.order(module, plugin, Some(snap), u64::MAX)
                }
            };
            orders.push(order);
        }
        Ok((!orders.is_empty()).then(|| self.give(Purpose::Reload, orders, moments)).flatten())
    }

    /// Orders instances of an older build for modules that failed; they make up for the steps since their
    /// last saved state. None: what they missed is remembered no more.
    pub fn order_takeover(&mut self, modules: &[(usize, Plugin)]) -> Option<Arc<Job>> {
        let mut orders = Vec::new();
        let mut moments = Moments::new();
        for (module, plugin) in modules {
            let frozen = self.frozen(*module).filter(|frozen| !frozen.stale)?.clone();
            frozen.snap.as_ref()?;
            moments.extend(frozen.moments.iter().map(|moment| (moment.step, moment.clone())));
            orders.push(self.order(*module, plugin.clone(), frozen.snap, u64::MAX));
        }
        self.give(Purpose::Takeover, orders, moments)
    }

    /// Orders another instance for a module that stands still, from its last good state: the step in which it
    /// failed, and those since, are left out. Without a state it begins anew.
    pub fn order_retry(&mut self, module: usize, plugin: &Plugin) -> Option<Arc<Job>> {
        if *self.members.get(module)?.instance.health() == Health::Running {
            return None;
        }
        let frozen = self.frozen(module)?;
        let Frozen { snap, moments, failed_in, .. } = frozen.clone();
        let order = self.order(module, plugin.clone(), snap, failed_in);
        self.give(
            Purpose::Retry,
            vec![order],
            moments.into_iter().map(|moment| (moment.step, moment)).collect(),
        )
    }

    fn frozen(&self, module: usize) -> Option<&Frozen> {
        let stands = *self.members[module].instance.health() != Health::Running;
        self.recent.as_ref()?.frozen[module].as_ref().filter(|_| stands)
    }

    fn order(&self, module: usize, plugin: Plugin, snap: Option<Snap>, until: u64) -> Order {
        let params = match snap {
            Some(_) => Vec::new(),
            None => self.members[module].first_events().collect(),
        };
        let config = self.setting.scene.modules[module].create_json(&self.setting.scene, self.setting.seed);
        Order { module, name: self.members[module].name.clone(), plugin, config, snap, params, until }
    }

    /// The job for these orders; it hears of every step from now on.
    fn give(&mut self, purpose: Purpose, orders: Vec<Order>, moments: Moments) -> Option<Arc<Job>> {
        let dt = self.clock.dt;
        let recent = self.recent.as_mut()?;
        let job = Arc::new(Job {
            purpose,
            began: Instant::now(),
            fixed: recent.fixed.clone(),
            now: recent.now.clone(),
            dt,
            assets: self.setting.scene.assets.clone(),
            orders: Mutex::new(orders),
            phase: Mutex::new(Phase::Working),
            queue: Mutex::new(moments.into_values().collect()),
            bell: Condvar::new(),
        });
        recent.followers.push(job.clone());
        Some(job)
    }

    /// Puts a job's instances in their places, if they have reached the present.
    pub fn swap(&mut self, job: &Job) -> Swap {
        let step = self.clock.step;
        let mut phase = lock(&job.phase);
        let candidates = match &mut *phase {
            Phase::Working => return Swap::NotYet,
            Phase::Ready(candidates) if !candidates.iter().all(|candidate| candidate.is_at(step)) => {
                return Swap::NotYet;
            }
            Phase::Ready(candidates) => std::mem::take(candidates),
            Phase::Failed(problem) => {
                let problem = std::mem::take(problem);
                *phase = Phase::Over;
                return Swap::Failed(problem);
            }
            Phase::Over => return Swap::Lost,
        };
        *phase = Phase::Over;
        drop(phase);
        job.cancel();
        let mut former = Vec::with_capacity(candidates.len());
        for candidate in candidates {
            let member = &mut self.members[candidate.module];
            former.push(std::mem::replace(&mut member.instance, candidate.instance));
            member.begin_anew();
            member.missed = candidate.missed;
            if let Some(recent) = &mut self.recent
                && recent.frozen[candidate.module].is_none()
            {
                recent.snaps[candidate.module] = candidate.snap;
            }
        }
        self.show_again();
        Swap::Done(former)
    }
}
