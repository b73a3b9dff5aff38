"""The controller: genome codings, the neuron's exact arithmetic, and its compiled form."""
