(() => {
  const table = document.getElementById('cases'), body = table.tBodies[0];
  const rows = [...body.rows], heads = [...table.tHead.rows[0].cells];
  const none = document.getElementById('none');
  let shown = 'all', words = '';
  const show = () => {
    let count = 0;
    for (const r of rows) {
      r.hidden = (shown !== 'all' && !shown.split(' ').includes(r.dataset.state)) || !r.textContent.toLowerCase().includes(words);
      count += r.hidden ? 0 : 1;
    }
    none.hidden = count > 0;
  };
  // Numbers by value, texts by the alphabet; what has no value stays at the end either way.
  const sort = (column, down) => {
    const value = r => r.cells[column].dataset.v ?? r.cells[column].textContent;
    const numeric = heads[column].classList.contains('n');
    rows.sort((a, b) => {
      const x = value(a), y = value(b);
      if (x === '' || y === '') return (x === '') - (y === '');
      const order = numeric ? x - y : x.localeCompare(y, 'en', { numeric: true });
      return down ? -order : order;
    });
    body.append(...rows);
    heads.forEach((h, i) => h.setAttribute('aria-sort', i !== column ? 'none' : down ? 'descending' : 'ascending'));
  };
  heads.forEach((h, i) => h.querySelector('button')?.addEventListener('click', () => sort(i, h.getAttribute('aria-sort') === 'ascending')));
  const buttons = [...document.querySelectorAll('.tools button')];
  for (const b of buttons) {
    b.addEventListener('click', () => {
      shown = b.dataset.show;
      buttons.forEach(o => o.setAttribute('aria-pressed', o === b));
      show();
    });
  }
  document.getElementById('find').addEventListener('input', e => { words = e.target.value.trim().toLowerCase(); show(); });
  const wanted = new URLSearchParams(location.hash.slice(1)).get('sort');
  if (wanted) sort(Math.abs(+wanted) - 1, +wanted < 0);
})();
