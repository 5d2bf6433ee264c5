
// The page of `chebclear show`: asks for the mechanism at the values of its sliders, and again when the file is saved.
(() => {
  const find = id => document.getElementById(id);
  let player = null, values = {}, asking = false, again = false, rows = "";

  async function ask() {
    again = true;
    if (asking) return;  // the newest values are asked for when the answer is there
    asking = true;
    while (again) {
      again = false;
      const query = new URLSearchParams({exaggerate: find("exaggerate").value});
      for (const [name, value] of Object.entries(values)) query.set("value." + name, value);
      try {
        take(await (await fetch("state?" + query)).json());
      } catch {
        ended();
      }
    }
    asking = false;
  }

  function say(id, tag, texts) {
    find(id).replaceChildren(...texts.map(text => Object.assign(document.createElement(tag), {textContent: text})));
  }

  function take(state) {
    find("title").textContent = state.title || state.file;
    document.title = state.file;
    say("problems", "pre", state.problems);
    find("film").classList.toggle("old", state.film === undefined);
    if (state.film !== undefined) {
      say("notes", "li", state.notes);
      if (player === null) player = playFilm(find("film"), state.film);
      else player.update(state.film);
      find("play").hidden = !state.play;
    }
    if (state.parameters.length || state.film !== undefined) show(state.parameters);
  }

  function show(parameters) {
    const known = JSON.stringify(parameters.map(({name, lower, upper}) => [name, lower, upper]));
    if (known !== rows) {
      rows = known;
      for (const name of Object.keys(values)) if (!parameters.some(one => one.name === name)) delete values[name];
      find("parameters").replaceChildren(...parameters.map(one => {
        const label = document.createElement("label"), slider = document.createElement("input");
        Object.assign(slider, {type: "range", min: 0, max: 200, step: 1, name: one.name});
        slider.addEventListener("input", () => {
          values[one.name] = one.lower + (one.upper - one.lower) * slider.value / 200;
          ask();
        });
        label.append(...[one.name, "", one.note].map((text, n) => Object.assign(document.createElement("span"),
          {textContent: text, className: ["name", "value", "end"][n]})), slider);
        return label;
      }));
    }
    [...find("parameters").children].forEach((label, n) => {
      const {value, lower, upper, words: [now, low, high]} = parameters[n], slider = label.querySelector("input");
      label.querySelector(".value").textContent = now + " (" + low + " to " + high + ")";
      slider.setAttribute("aria-valuetext", now);
      if (document.activeElement !== slider) slider.value = upper > lower ? Math.round(200 * (value - lower) / (upper - lower)) : 0;
    });
  }

  const ended = () => say("problems", "pre", ["chebclear show has ended: nothing is computed any more."]);
  find("nominal").addEventListener("click", () => { values = {}; ask(); });
  find("exaggerate").addEventListener("change", ask);
  const saved = new EventSource("saved");
  saved.addEventListener("message", ask);
  saved.addEventListener("error", ended);
})();
