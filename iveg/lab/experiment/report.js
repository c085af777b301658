// The reader's language and theme; figures are drawn in them.  Runs in a sandbox
// without an origin, so that nothing is remembered.
"use strict";
{
  const root = document.documentElement;
  const asked = new URLSearchParams(location.search);
  const wanted = asked.get("lang") ?? navigator.language.slice(0, 2);
  const buttons = [...document.querySelectorAll("nav button")];
  const themes = ["light", "dark", "sunlight"];
  const DASHES = { uplink: "dot", fiware: "dash", iveg: "solid" };
  const HUES = { odometry: "--robot-1", detections: "--robot-2", lidar: "--robot-5" };

  const token = (name) => getComputedStyle(root).getPropertyValue(name).trim();

  function dressed(trace, index) {
    if (trace.type === "bar")
      return { ...trace, marker: { color: token(["--text-2", "--hop-screen"][index]) } };
    const { data, hop } = trace.meta;
    const line = { ...trace.line, color: token(HUES[data]), dash: DASHES[hop] };
    return { ...trace, line };
  }

  function draw(place) {
    const { data, layout } = JSON.parse(place.nextElementSibling.textContent);
    const grid = { gridcolor: token("--line"), linecolor: token("--line-strong") };
    const axis = (name) => ({
      ...layout[`${name}axis`],
      ...grid,
      automargin: true,
      title: { text: layout.meta[name] },
    });
    const look = {
      ...layout,
      xaxis: axis("x"),
      yaxis: axis("y"),
      paper_bgcolor: "transparent",
      plot_bgcolor: "transparent",
      font: { family: token("--font"), size: 13, color: token("--text") },
      separators: root.lang === "es" ? ",." : ".,",
      legend: { orientation: "h", y: 1.02, yanchor: "bottom" },
      margin: { l: 60, r: 16, t: 16, b: 40 },
    };
    const config = { displayModeBar: false, responsive: true };
    Plotly.react(place, data.map(dressed), look, config);
  }

  function show() {
    for (const one of buttons)
      one.setAttribute("aria-pressed", String(one.lang === root.lang));
    document.title = document.querySelector(`main[lang=${root.lang}] h1`).textContent;
    for (const one of document.querySelectorAll(`main[lang=${root.lang}] .figure`))
      draw(one);
  }

  function choose(language) {
    root.lang = language;
    show();
  }

  for (const one of buttons) one.addEventListener("click", () => choose(one.lang));
  if (themes.includes(asked.get("theme"))) root.dataset.theme = asked.get("theme");
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", show);
  // Paper is light.
  const theme = root.dataset.theme;
  const on = (name, chosen) =>
    addEventListener(name, () => {
      root.dataset.theme = chosen;
      show();
    });
  on("beforeprint", "light");
  on("afterprint", theme);
  choose(wanted === "es" ? "es" : "en");
}
