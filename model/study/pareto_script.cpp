#include "model/study/pareto_script.h"

namespace degas {

const char* const pareto_style = R"css(<style>
body{max-width:1300px}
.charts svg{max-width:100%;height:auto}
[data-point]{cursor:pointer}
svg [data-point]:hover *,svg [data-point].chosen *{stroke:#d99a00;stroke-width:3}
button{font:inherit;color:#1b6ca8;background:none;border:0;padding:0;text-decoration:underline}
.controls label{margin-right:1em}.controls input{width:6em;font:inherit}.controls select{font:inherit}
caption{text-align:left;font-weight:600;padding:.4em 0}
tr.take{background:#e2f3e8}tr.chosen{background:#fff3d0}
.choice td:nth-child(2),.choice td:nth-child(4){text-align:left}
.wide{overflow-x:auto}
#detail{border:1px solid #ddd;padding:.6em 1em;min-height:4em}
#detail code{word-break:break-all}
#tip{position:fixed;right:1em;bottom:1em;max-width:34em;background:#fff;border:1px solid #bbb;padding:.5em .8em;
box-shadow:0 2px 8px #0003;font-size:13px;display:none}
</style>)css";

const char* const pareto_script = R"js(
const data = JSON.parse(document.getElementById("data").textContent);
const detail = document.getElementById("detail");
const tip = document.body.appendChild(document.createElement("div"));
tip.id = "tip";

function add(parent, tag, text) {
  const element = parent.appendChild(document.createElement(tag));
  if (text !== undefined) element.textContent = text;
  return element;
}
function describe(parent, point) {
  add(parent, "b", point.name + (point.baseline ? " (baseline)" : ""));
  add(parent, "div", (point.fps * factor()).toFixed(1) + " frames/s");
  for (const picture of point.pictures) add(parent, "div", picture.title + ": " + picture.figures.join(", "));
  add(parent, "div", point.differences.length ? "Unlike the base: " + point.differences.join(", ") : "The base.");
}
function show(index) {
  const point = data[index];
  detail.replaceChildren();
  describe(detail, point);
  add(detail, "div", "Config: " + point.config + point.set.map(text => " --set " + text).join(""));
  add(add(detail, "div", "Trained by: "), "code", point.command);
  add(detail, "div", "Commit: " + point.commit);
  for (const picture of point.pictures) {
    if (!picture.source) continue;
    const figure = add(detail, "figure");
    add(figure, "img").src = picture.source;
    add(figure, "figcaption", picture.title + ": truth, render, error times 4");
  }
  for (const element of document.querySelectorAll("[data-point]"))
    element.classList.toggle("chosen", element.dataset.point === String(index));
  detail.scrollIntoView({behavior: "smooth", block: "nearest"});
}
for (const element of document.querySelectorAll("[data-point]")) {
  element.addEventListener("click", () => show(Number(element.dataset.point)));
  element.addEventListener("keydown", event => {
    if (event.key === "Enter") show(Number(element.dataset.point));
  });
  element.addEventListener("mouseenter", () => {
    tip.replaceChildren();
    describe(tip, data[Number(element.dataset.point)]);
    tip.style.display = "block";
  });
  element.addEventListener("mouseleave", () => { tip.style.display = "none"; });
}

function factor() {
  const speed = Number(document.getElementById("speed").value);
  return speed > 0 ? speed / data[Number(document.getElementById("known").value)].fps : 1;
}
function update() {
  const scale = factor(), target = Number(document.getElementById("target").value);
  for (const element of document.querySelectorAll("[data-fps]"))
    element.textContent = (Number(element.dataset.fps) * scale).toFixed(1);
  for (const row of document.querySelectorAll("tr[data-to]"))
    row.classList.toggle("take", scale * Number(row.dataset.from) < target && target <= scale * Number(row.dataset.to));
}
for (const id of ["target", "known", "speed"]) document.getElementById(id).addEventListener("input", update);
update();
)js";

}  // namespace degas
