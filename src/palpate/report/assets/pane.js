// A figure that is larger than its column grows to its own size at a click, and scrolls in its box.
document.querySelectorAll(".pane").forEach((pane) => {
  const image = pane.querySelector("img");
  const fits = () => image.getAttribute("width") <= pane.clientWidth;
  const grow = () => {
    if (fits() && !pane.classList.contains("whole")) return;
    pane.classList.toggle("whole");
  };
  pane.title = "click to see the figure at its own size, and again to go back";
  pane.addEventListener("click", grow);
  pane.addEventListener("keydown", (event) => event.key === "Enter" && grow());
  new ResizeObserver(() => pane.classList.toggle("large", !fits())).observe(pane);
  pane.tabIndex = 0;
});
