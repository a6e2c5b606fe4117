/* What the pages need beside htmx: charts that come with a part of a page, and the drop zone. */
"use strict";
document.addEventListener("htmx:load", () => servoCharts.draw());

(() => {
  const zone = document.getElementById("zone");
  if (!zone) return;
  const input = zone.querySelector("input[type=file]"), said = zone.querySelector("[role=alert]");
  const most = Number(zone.dataset.most);

  function tell(text) {
    said.textContent = text;
    said.hidden = !text;
  }

  function fits() {
    const file = input.files[0];
    if (!file) return false;
    if (file.size > most) {
      tell(`${file.name} has ${(file.size / 1e6).toFixed(1)} MB, at most ${(most / 1e6).toFixed(0)} MB are taken; cut the log.`);
      return false;
    }
    tell("");
    return true;
  }

  let depth = 0;
  const over = (more) => { depth += more; zone.classList.toggle("over", depth > 0); };
  document.addEventListener("dragenter", (event) => { event.preventDefault(); over(1); });
  document.addEventListener("dragleave", () => over(-1));
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    depth = 0; over(0);
    if (!event.dataTransfer.files.length) return;
    input.files = event.dataTransfer.files;
    if (fits()) zone.requestSubmit();
  });
  input.addEventListener("change", fits);
  zone.addEventListener("submit", (event) => {
    if (!fits()) { event.preventDefault(); return; }
    const button = zone.querySelector("button");
    button.disabled = true;
    button.textContent = "Sending …";
  });
  window.addEventListener("pageshow", () => {
    const button = zone.querySelector("button");
    button.disabled = false;
    button.textContent = "Check it";
  });
})();
