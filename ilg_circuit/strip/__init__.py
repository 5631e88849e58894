"""What a strip is: sizes and materials, its electrical model, the lumped elements that follow, where the model holds.

In: a TOML file or a preset. Out: `Actuator`, `Port`, lumped elements, validity. May import: the ground floor and `fit`.
"""
