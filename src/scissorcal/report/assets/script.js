"use strict";
(() => {
  const $ = (selector, from = document) => [...from.querySelectorAll(selector)];
  const tip = document.createElement("div");
  tip.className = "tip";
  tip.setAttribute("role", "status");
  document.body.append(tip);

  // ---- search and opening -------------------------------------------------
  const tools = $("nav .tools")[0];
  if (tools) tools.hidden = false;
  const search = document.getElementById("search");
  const found = document.getElementById("found");
  const parts = $("details.part");
  const panels = $(".panel");
  const find = () => {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let count = 0;
    for (const panel of panels) {
      const text = panel.textContent.toLowerCase();
      const hit = words.every((word) => text.includes(word));
      panel.classList.toggle("miss", !hit);
      count += hit ? 1 : 0;
      for (const row of $("tbody tr", panel)) {
        const said = (panel.querySelector("h3")?.textContent ?? "") + row.textContent;
        row.classList.toggle("hit", words.length > 0 && hit &&
          words.every((word) => said.toLowerCase().includes(word)));
      }
      if (words.length && hit && panel.open !== undefined) panel.open = true;
    }
    for (const part of parts) {
      const own = $(".panel", part);
      const hit = !words.length || own.some((panel) => !panel.classList.contains("miss"));
      part.parentElement.classList.toggle("miss", !hit);
      if (words.length) part.open = hit;
    }
    found.textContent = words.length ? `${count} of ${panels.length} panels` : "";
  };
  if (search) search.addEventListener("input", find);
  const everything = document.getElementById("open-all");
  let shut = [];
  const openAll = (open) => {
    if (open) shut = $("details").filter((one) => !one.open);
    (open ? $("details") : shut).forEach((one) => { one.open = open; });
  };
  if (everything) everything.addEventListener("click", () => {
    const open = everything.textContent === "Open all";
    openAll(open);
    everything.textContent = open ? "Close" : "Open all";
  });
  // what was opened by hand is printed, too
  let opened = [];
  addEventListener("beforeprint", () => {
    opened = $("details.part, details[data-print]").filter((one) => !one.open);
    opened.forEach((one) => { one.open = true; });
  });
  addEventListener("afterprint", () => opened.forEach((one) => { one.open = false; }));
  const reveal = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!target) return;
    const own = target.matches("section") ? target.querySelector("details.part") : null;
    if (own) own.open = true;
    for (let up = target; up; up = up.parentElement) if (up.tagName === "DETAILS") up.open = true;
    target.scrollIntoView();
  };
  addEventListener("hashchange", reveal);
  reveal();

  // ---- charts: switch series, read values ---------------------------------
  const scale = (text) => {
    const [low, high, start, end, kind] = text.split(" ");
    const log = kind === "log";
    const f = log ? Math.log : (v) => v;
    return (pixel) => {
      const v = f(+low) + (pixel - start) / (end - start) * (f(+high) - f(+low));
      return log ? Math.exp(v) : v;
    };
  };
  const said = (v) => {
    const text = Math.abs(v) >= 1e5 || (v && Math.abs(v) < 1e-4) ? v.toExponential(2) : v.toPrecision(4);
    return text.includes("e") ? text : String(+text).replace("-", "−");
  };
  const points = (figure) => {
    if (figure.points) return figure.points;
    figure.points = [];
    for (const group of $("g.s", figure)) {
      if (group.classList.contains("band")) continue;
      for (const path of $("path:not(.error)", group)) {
        for (const [, x, y] of path.getAttribute("d").matchAll(/[ML](-?[\d.]+) (-?[\d.]+)/g)) {
          figure.points.push({ x: +x, y: +y, group });
        }
      }
      for (const rect of $("rect", group)) {
        const box = rect.getBBox();
        const value = rect.querySelector("title")?.textContent;
        const x = value ? box.x + box.width / 2 : box.x + box.width;
        figure.points.push({ x, y: box.y + box.height / 2, group, value });
      }
    }
    figure.points.sort((a, b) => a.x - b.x);
    return figure.points;
  };
  const show = (figure, point, at) => {
    const svg = figure.querySelector("svg");
    $(".cross", figure).forEach((one) => one.remove());
    if (!point) { tip.style.display = "none"; return; }
    const cross = document.createElementNS(svg.namespaceURI, "circle");
    cross.setAttribute("class", "cross");
    cross.setAttribute("cx", point.x);
    cross.setAttribute("cy", point.y);
    cross.setAttribute("r", 4.5);
    svg.append(cross);
    const labels = ["xlabel", "ylabel"].map((key) => figure.dataset[key].split("|"));
    const values = [scale(svg.dataset.x)(point.x), scale(svg.dataset.y)(point.y)];
    const lines = [point.group.dataset.name];
    labels.forEach(([name, unit], i) => {
      if (name) lines.push(`${name} ${said(values[i])} ${unit}`.trim());
    });
    if (point.value) lines.push(`value ${point.value}`);
    tip.textContent = lines.filter(Boolean).join("\n");
    tip.style.display = "block";
    const box = svg.getBoundingClientRect();
    const ratio = box.width / svg.viewBox.baseVal.width;
    const x = at ? at.clientX : box.left + point.x * ratio;
    const y = at ? at.clientY : box.top + point.y * ratio;
    tip.style.left = `${Math.max(4, Math.min(x + 14, innerWidth - tip.offsetWidth - 8))}px`;
    tip.style.top = `${Math.max(4, y - tip.offsetHeight - 10)}px`;
  };
  const visible = (figure) =>
    points(figure).filter((point) => !point.group.classList.contains("off"));
  for (const figure of $("figure[data-xlabel]")) {
    const svg = figure.querySelector("svg");
    svg.addEventListener("pointermove", (event) => {
      const box = svg.getBoundingClientRect();
      const ratio = svg.viewBox.baseVal.width / box.width;
      const x = (event.clientX - box.left) * ratio;
      const y = (event.clientY - box.top) * ratio;
      let best = null;
      let least = 24 * 24;
      for (const point of visible(figure)) {
        const away = (point.x - x) ** 2 + (point.y - y) ** 2;
        if (away < least) { least = away; best = point; }
      }
      show(figure, best, event);
    });
    svg.addEventListener("pointerleave", () => show(figure, null));
    let step = -1;
    figure.addEventListener("keydown", (event) => {
      const way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (event.target !== figure || (!way && event.key !== "Escape")) return;
      const own = visible(figure);
      step = way ? (step + way + own.length) % own.length : -1;
      show(figure, way ? own[step] : null);
      if (way) event.preventDefault();
    });
    figure.addEventListener("blur", () => show(figure, null));
    for (const entry of $(".key li[data-group]", figure)) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = entry.textContent;
      button.setAttribute("aria-pressed", "true");
      entry.replaceChildren(button);
      const own = $("g.s", figure).filter((one) => one.dataset.group === entry.dataset.group);
      const turn = (on) => {
        button.setAttribute("aria-pressed", String(on));
        own.forEach((one) => one.classList.toggle("off", !on));
      };
      button.turn = turn;
      button.addEventListener("click", () => turn(button.getAttribute("aria-pressed") !== "true"));
      button.addEventListener("dblclick", () => {
        $(".key button", figure).forEach((other) => other.turn(other === button));
      });
    }
  }
})();
