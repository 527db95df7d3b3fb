// A box that is wider than the screen is marked as one that scrolls sideways.
const boxes = new ResizeObserver((entries) => {
  for (const { target } of entries) target.classList.toggle("wide", target.scrollWidth > target.clientWidth + 1);
});
document.querySelectorAll(".pane, .scroll").forEach((box) => boxes.observe(box));

// A figure that is larger than its column grows to its own size at a click, and scrolls in its box.
document.querySelectorAll(".pane").forEach((pane) => {
  const image = pane.querySelector("img");
  const large = () => Number(image.getAttribute("width")) > pane.parentElement.clientWidth;
  const grow = () => {
    if (!large() && !pane.classList.contains("whole")) return;
    pane.classList.toggle("whole");
    pane.classList.toggle("wide", pane.scrollWidth > pane.clientWidth + 1);
  };
  new ResizeObserver(() => {
    pane.classList.toggle("large", large());
    pane.tabIndex = large() ? 0 : -1;
    pane.title = large() ? "click to see the figure at its own size, and again to go back" : "";
  }).observe(pane.parentElement);
  pane.addEventListener("click", grow);
  pane.addEventListener("keydown", (event) => event.key === "Enter" && grow());
});
