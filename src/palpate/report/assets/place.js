// The navigation marks what is being read, and shows the sections of that part only.
const links = [...document.querySelectorAll("nav a")];
const places = links.map((link) => document.getElementById(link.hash.slice(1)));
const inSight = new Set();

const mark = () => {
  // of a part and its section the section comes later
  const current = links.findLast((_, i) => inSight.has(places[i]));
  if (!current) return;
  for (const link of links) {
    if (link === current) link.setAttribute("aria-current", "true");
    else link.removeAttribute("aria-current");
  }
  document.querySelectorAll("nav > ul > li").forEach((part) => part.classList.toggle("current", part.contains(current)));
};

const watcher = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) inSight[isIntersecting ? "add" : "delete"](target);
  mark();
}, { rootMargin: "-12% 0px -80% 0px" });
places.forEach((place) => watcher.observe(place));

// What is folded away opens when a link leads into it.
const unfoldTarget = () => {
  const target = document.getElementById(location.hash.slice(1));
  for (let box = target?.closest("details"); box; box = box.parentElement.closest("details")) box.open = true;
  target?.scrollIntoView();
};
addEventListener("hashchange", unfoldTarget);
if (location.hash) unfoldTarget();
