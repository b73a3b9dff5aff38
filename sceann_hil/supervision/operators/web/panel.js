"use strict";
// A second tap that was meant for the question before must not answer this one.
const GUARD_MS = 400;
const SILENCE_MS = 3000;
const ALIVE_MS = 4000;
// A stop whose answer is lost is sent again: stopping twice is better than not at all.
const PATIENCE_MS = 1000;
const TRIES = {stop: 3, emergency_stop: 10};
const MAIN = ["ready", "goal", "accept", "resume"];
const ANSWERS = ["ready", "skip", "abort", "goal", "accept", "redo", "discard", "resume"];
const ASKS = {discard: "Why does this trial not count?", note: "Note"};
const NOT_SENT = "not sent, there is no connection";
const $ = id => document.getElementById(id);
let view = null, shown = "", offered = "", lastHeard = Date.now(), asking = null, freshSince = 0;

function time(s) {
  s = Math.round(s);
  const h = Math.floor(s / 3600), m = Math.floor(s / 60) % 60;
  return s < 60 ? s + " s" : (h ? h + " h " : "") + m + " min";
}
function capital(words) { return words.charAt(0).toUpperCase() + words.slice(1); }
function label(verb) {
  const words = view.verbs[verb].label;
  if (MAIN.includes(verb)) return words.toUpperCase();
  return capital(words) + (view.verbs[verb].wants_text ? "..." : "");
}

async function send(verb, question, text) {
  const body = JSON.stringify({verb, question, text});
  for (let left = TRIES[verb] || 1; left > 0; left--) {
    try {
      const reply = await fetch("/press", {method: "POST", headers: {"Content-Type": "application/json"}, body,
        priority: "high", signal: TRIES[verb] ? AbortSignal.timeout(PATIENCE_MS) : undefined});
      const isJson = (reply.headers.get("Content-Type") || "").startsWith("application/json");
      return isJson ? (await reply.json()).message : await reply.text();
    } catch {
      $("receipt").textContent = verb + ": " + NOT_SENT;
      if (left > 1) await new Promise(go => setTimeout(go, 200));
    }
  }
  return verb + ": " + NOT_SENT;
}
async function press(verb, question, text = "") {
  if (!text && view && view.verbs[verb] && view.verbs[verb].wants_text) return ask(verb, question);
  if (verb in TRIES) $("receipt").textContent = verb.replace("_", " ") + ": sending...";
  $("receipt").textContent = await send(verb, question, text);
}

// Words are asked for in the page itself: nothing lies over the stops, and they stay within reach of keys and readers.
function ask(verb, question) {
  asking = {verb, question};
  $("asked").textContent = ASKS[verb] || capital(view.verbs[verb].label);
  $("text").value = "";
  $("words").hidden = false;
  $("text").focus();
  $("words").scrollIntoView({block: "nearest"});
}
function askNoMore() { asking = null; $("words").hidden = true; $("text").blur(); }
$("words").onsubmit = async event => {
  event.preventDefault();
  const text = $("text").value.trim(), {verb, question} = asking || {};
  if (!text || !verb) return $("text").focus();
  const message = await send(verb, question, text);
  $("receipt").textContent = message;
  if (!message.endsWith(NOT_SENT)) askNoMore();
};
$("words_cancel").onclick = askNoMore;

function button(verb, question) {
  const made = document.createElement("button");
  made.id = verb; made.type = "button"; made.dataset.verb = verb; made.textContent = label(verb);
  if (MAIN.includes(verb)) made.className = "main";
  else {
    const means = document.createElement("small");
    means.textContent = view.verbs[verb].means; made.append(means);
  }
  made.setAttribute("aria-keyshortcuts", view.verbs[verb].key);
  made.onclick = () => press(verb, question);
  return made;
}
function scores(question) {
  const row = document.createElement("div");
  row.className = "scores"; row.setAttribute("role", "group"); row.setAttribute("aria-label", "Accept: how good was it?");
  for (let score = 0; score <= 9; score++) {
    const made = document.createElement("button");
    made.id = "score" + score; made.type = "button"; made.dataset.score = score; made.textContent = score;
    made.onclick = () => press("accept", question, String(score));
    row.append(made);
  }
  const said = document.createElement("p");
  said.className = "quiet"; said.textContent = "Accept: how good was it, 0 to 9?"; row.prepend(said);
  return row;
}
function guard(buttons) {
  const fresh = [...buttons];
  freshSince = Date.now();
  fresh.forEach(b => b.disabled = true);
  setTimeout(() => { if ($("offline").hidden) fresh.forEach(b => b.disabled = false); }, GUARD_MS);
}
function ring() {
  if (view.prompt === "none" || !view.question) return;
  try {
    const audio = new AudioContext(), tone = audio.createOscillator();
    tone.connect(audio.destination); tone.frequency.value = 880; tone.start(); tone.stop(audio.currentTime + 0.15);
  } catch {}
  if (view.prompt === "speech" && window.speechSynthesis)
    speechSynthesis.speak(new SpeechSynthesisUtterance(view.instruction || view.outcome));
}
function fill(place, entries, make) { place.replaceChildren(...entries.map(make)); }

// Both stops can be pressed at any time. Whether there is something to stop, the run knows best: it may have begun a
// trial a moment ago. What is offered (data-verb) and what is shown as idle follows the last view.
function stops() {
  for (const verb of ["stop", "emergency_stop"]) {
    const counts = view !== null && $("offline").hidden && view.accepts.includes(verb);
    if (counts) $(verb).dataset.verb = verb; else delete $(verb).dataset.verb;
  }
  $("stop").classList.toggle("idle", !$("stop").dataset.verb);
  $("stop").querySelector("small").textContent = $("stop").dataset.verb ? "this trial" : "no trial runs";
}
function render() {
  const v = view, key = v.phase + "/" + v.question, accepts = v.accepts.join();
  $("run").textContent = v.run || "sceann"; $("phase").textContent = v.phase; document.body.dataset.phase = v.phase;
  document.body.dataset.question = v.question;
  document.title = capital(v.phase) + " - " + (v.run || "sceann");
  $("title").textContent = v.title;
  const what = {before: v.instruction, running: "The trial runs.", after: v.outcome,
    paused: "Paused: " + v.reason, suspended: "Paused by itself: " + v.reason, closed: "Over: " + v.reason,
    idle: "Nothing to do."}[v.phase];
  if ($("what").textContent !== what) $("what").textContent = what;
  $("remark").textContent = v.remark; $("remark").hidden = !v.remark || v.phase === "closed";
  const banners = v.warnings.map(w => ["banner", w]);
  if (v.pausing && v.phase !== "paused") banners.push(["banner info", "A pause begins after this trial."]);
  if (v.finishing && v.phase !== "closed") banners.push(["banner info", "The run ends after this trial."]);
  if ($("warnings").dataset.shown !== JSON.stringify(banners)) {
    $("warnings").dataset.shown = JSON.stringify(banners);
    fill($("warnings"), banners, ([kind, text]) => {
      const made = document.createElement("div"); made.className = "card " + kind; made.textContent = text; return made; });
  }
  if (key !== shown || accepts !== offered) {
    const focused = document.activeElement && document.activeElement.dataset.verb;
    fill($("answers"), ANSWERS.filter(a => v.accepts.includes(a)), 
      a => a === "accept" && v.scored ? scores(v.question) : button(a, v.question));
    const others = v.accepts.filter(a => !ANSWERS.includes(a) && a !== "emergency_stop" && a !== "stop");
    fill($("others"), others, a => button(a, null));
    // who walks through the page with keys keeps their place
    if (focused && $(focused) && document.activeElement === document.body) $(focused).focus();
    offered = accepts;
  }
  stops();
  if (key !== shown) {
    $("pose").hidden = v.phase !== "before"; if (v.phase === "before") $("pose").src = v.pose;
    guard($("answers").querySelectorAll("button")); ring(); shown = key;
  }
  $("progress").max = Math.max(1, v.todo); $("progress").value = v.done;
  const facts = [["generation", v.generation + " of " + v.generations], ["trials of it", v.done + " of " + v.todo],
    ["robot", v.robot + (v.robot_ok ? "" : " (not ready)")]];
  if (v.robot_messages.length) facts.push(["it says", v.robot_messages.join(", ")]);
  if (v.link_quality !== null) facts.push(["link", (100 * v.link_quality).toFixed(1) + " % at the first try"]);
  if (v.battery !== null) facts.push(["battery", Math.round(100 * v.battery) + " %"]);
  facts.push(["time", time(v.wall_s) + ", robot " + time(v.robot_s)]);
  v.left.forEach(l => facts.push(["budget", l]));
  if (v.best) facts.push(["in this generation", v.best]);
  if (v.forecast) facts.push(["forecast", v.forecast]);
  if (v.last) facts.push(["last said", v.last]);
  $("facts").replaceChildren(...facts.flatMap(([name, value]) => {
    const dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = name; dd.textContent = value; return [dt, dd]; }));
  fill($("trials"), v.history, h => {
    const row = document.createElement("tr");
    for (const text of [h.title, h.outcome]) { const cell = document.createElement("td"); cell.textContent = text; row.append(cell); }
    return row; });
}

function offline(why) {
  if (why === GONE && view && view.phase === "closed") why = "";
  if ($("offline").textContent === why) return;
  $("offline").textContent = why;
  $("offline").hidden = !why;
  document.querySelectorAll("#answers button, #others button").forEach(b => {
    b.disabled = !!why; if (why) delete b.dataset.verb; });
  stops();
}
const GONE = "No connection to the run. It waits; what is pressed here may not arrive.";
const STRANGER = "This page's link is not valid any more. Open the link that the run printed last.";
function heard() {
  lastHeard = Date.now();
  if ($("offline").hidden) return;
  offline(""); shown = offered = "";
  if (view) render();
}
function connect() {
  const events = new EventSource("/events");
  events.onmessage = e => { view = JSON.parse(e.data); if (!view.verbs) { view = null; return; } heard(); render(); };
  events.addEventListener("alive", heard);
  events.onerror = async () => {
    if (events.readyState !== EventSource.CLOSED) return;
    const reply = await fetch("/alive").catch(() => null);
    offline(reply && reply.status === 403 ? STRANGER : GONE);
    setTimeout(connect, 1000);
  };
}
connect();
setInterval(() => { if (Date.now() - lastHeard > SILENCE_MS && $("offline").hidden) offline(GONE); }, 500);
// keeps a connection open beside the one of the events, so that a stop need not open one
setInterval(() => fetch("/alive").catch(() => null), ALIVE_MS);

$("stop").onclick = () => press("stop", null);
$("emergency_stop").onclick = () => press("emergency_stop", null);
function said(key) { return (view.keys[key] || []).find(verb => view.accepts.includes(verb)); }
function stopFor(event) {
  if (event.ctrlKey || event.altKey || event.metaKey) return null;
  const typing = document.activeElement === $("text");
  if (event.key === "F9" || (event.key === "!" && !typing)) return "emergency_stop";
  if (event.key === "F8") return "stop";
  return !typing && view && view.phase === "running" && said(event.key) === "stop" ? "stop" : null;
}
addEventListener("keydown", event => {
  const stop = stopFor(event);
  if (stop) { event.preventDefault(); if (!event.repeat) press(stop, null); return; }
  const typing = document.activeElement === $("text");
  if (event.key === "Escape" && !$("words").hidden) { askNoMore(); return; }
  if (typing || event.repeat || event.ctrlKey || event.altKey || event.metaKey || !view || !$("offline").hidden) return;
  const score = $("score" + event.key);
  if (score) { event.preventDefault(); if (!score.disabled) score.click(); return; }
  const verb = said(event.key);
  const made = verb && $(verb);
  if (made && !made.disabled) { event.preventDefault(); made.click(); }
}, true);
// a button that has the focus is clicked when the space bar is let go
addEventListener("keyup", event => { if (stopFor(event) === "stop") event.preventDefault(); }, true);

// a phone's keyboard lies over the window's lower edge: the stops stay above it
if (window.visualViewport) {
  const above = () => {
    const hidden = innerHeight - visualViewport.height - visualViewport.offsetTop;
    $("stops").style.transform = hidden > 1 ? `translateY(${-hidden}px)` : "";
  };
  visualViewport.addEventListener("resize", above); visualViewport.addEventListener("scroll", above);
}
