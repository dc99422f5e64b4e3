// Only in a watched build: asks the folder once a second whether it is newer than this page. A script is what a page that
// was opened from a disk may still load.
(() => {
  "use strict";
  let shown = null;
  window.domecastBuild = (stamp) => {
    if (shown !== null && stamp !== shown) location.reload();
    shown = stamp;
  };
  setInterval(() => {
    const script = document.createElement("script");
    script.src = "fresh-stamp.js?" + Date.now();
    script.onload = script.onerror = () => script.remove();
    document.head.append(script);
  }, 1000);
})();
