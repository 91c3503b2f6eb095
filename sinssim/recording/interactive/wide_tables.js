// A table that is wider than the page can be moved with the keys.
"use strict";
addEventListener("DOMContentLoaded", () => {
  const sizes = new ResizeObserver(seen => {
    for (const {target} of seen) {
      if (target.scrollWidth <= target.clientWidth + 1) target.removeAttribute("tabindex");
      else Object.assign(target, {tabIndex: 0, role: "group", ariaLabel: "Table, wider than the page"});
    }
  });
  const watch = () => document.querySelectorAll(".wide:not(.several_list)").forEach(table => sizes.observe(table));
  watch();
  new MutationObserver(watch).observe(document.body, {childList: true, subtree: true});
});
