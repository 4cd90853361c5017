namespace splid {}
