// The list of episodes: the reader chooses one by its number and outcome.

function episodesList(data, choose) {
  const ends = new Map((data.events ?? []).filter((line) => line.end).map((line) => [line.episode, line.end]));
  // Steps, as the story counts them: decisions that the robot began to carry out.
  const counts = new Map();
  for (const line of data.events ?? []) {
    if (line.decision) counts.set(line.episode, (counts.get(line.episode) ?? 0) + (line.decision.begun ? 1 : 0));
  }
  const filmed = new Set((data.films ?? []).map((film) => film.episode));
  const failures = new Map((data.run?.summary?.failures ?? []).map(({ episode, reason }) => [episode, reason]));
  const numbers = [...ends.keys()].sort((a, b) => a - b);
  const buttons = new Map();
  const rows = numbers.map((number) => {
    const button = make("button", `Episode ${number + 1}`);
    button.type = "button";
    button.addEventListener("click", () => choose(number));
    buttons.set(number, button);
    const end = ends.get(number);
    const solved = end.ended === "GoalMet" && end.assembled;
    const why = endInWords(end, failures.get(number));
    const has = counts.has(number) ? (filmed.has(number) ? "pictures and decisions" : "decisions") : "outcome only";
    return [button, solved ? "solved" : `failed: ${why}`, String(counts.get(number) ?? "–"), end.simulated_s.toFixed(1), has];
  });
  const grid = table(["episode", "outcome", ">steps", ">simulated s", "on this page"], rows);
  grid.classList.add("episodes");
  return { grid, buttons };
}
