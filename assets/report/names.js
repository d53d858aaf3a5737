// Sentences for symbols: states, actions and objects as people name them, where the files have words for them.

class Names {
  constructor(run, domain) {
    const own = [...(domain?.states ?? []), ...(domain?.operators ?? [])].filter(({ words }) => words);
    this.learned = new Map(own.map(({ name, words }) => [name, words]));
    this.words = new Map([...this.learned, ...Object.entries(run?.words ?? {})]);
    this.hidden = new Set(run?.planner_only ?? []);
  }

  // The words for a symbol, or else the symbol itself.
  say(symbol) {
    const not = symbol.startsWith("not ") ? symbol.slice(4) : null;
    if (!this.words.has(symbol) && not !== null && this.words.has(not)) return `not: ${this.words.get(not)}`;
    return this.words.get(symbol) ?? symbol;
  }

  // The words for a learned state. A fact of the planner that counts objects can have the state's symbol.
  sayState(symbol) {
    return this.learned.get(symbol) ?? this.say(symbol);
  }

  // As the beginning of a sentence. Symbols keep their spelling.
  begin(symbol) {
    return capital(this.say(symbol));
  }

  // The facts that people care about. All of them, if none would be left.
  shown(facts) {
    // Of the only one of its kind there is no other.
    const trivial = (fact) => /^no (.+) other than the \1 /.test(this.say(fact));
    const shown = facts.filter((fact) => !this.hidden.has(fact) && !trivial(fact));
    return shown.length ? shown : facts;
  }

  list(symbols, most = Infinity) {
    const said = symbols.map((symbol) => this.say(symbol));
    const more = said.length - most;
    return more > 0 ? `${said.slice(0, most).join("; ")}; and ${more} more` : said.join("; ");
  }
}
